#include "db/surface_pool.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

#include "db/patch_surface.h"

namespace patchwork {

namespace {

class HugePages : public std::pmr::memory_resource {
  static constexpr std::size_t kPage = std::size_t{2} << 20;

  void* do_allocate(std::size_t bytes, std::size_t) override {
    const std::size_t whole = (bytes + kPage - 1) / kPage * kPage;
    void* p = std::aligned_alloc(kPage, whole);
    if (!p) throw std::bad_alloc();
    madvise(p, whole, MADV_HUGEPAGE);  // advice: without it all works, slower
    return p;
  }
  void do_deallocate(void* p, std::size_t, std::size_t) override { std::free(p); }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

}  // namespace

std::pmr::memory_resource& surface_pool() {
  static auto* const pages = new HugePages;
  static auto* const pool = new std::pmr::synchronized_pool_resource(
      {.max_blocks_per_chunk = 512, .largest_required_pool_block = 2 * sizeof(PatchSurface)}, pages);
  return *pool;
}

}  // namespace patchwork
