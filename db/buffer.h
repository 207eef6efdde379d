// A large array that is not cleared, in huge pages where the system has them.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

namespace patchwork {

/// CAVEAT: holds whatever was in memory until it is written. Clearing and faulting in 4096 x 4096 floats page
/// by page took 0.1 s, as long as computing their errors.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Buffer() = default;
  /// Throws std::bad_alloc.
  explicit Buffer(std::size_t n) : size_(n) {
    if (n == 0) return;
    const std::size_t page = n * sizeof(T) < kHugePage ? kCacheLine : kHugePage;
    const std::size_t bytes = (n * sizeof(T) + page - 1) / page * page;
    data_.reset(static_cast<T*>(std::aligned_alloc(page, bytes)));
    if (!data_) throw std::bad_alloc();
    if (page == kHugePage)
      madvise(data_.get(), bytes, MADV_HUGEPAGE);  // advice: without it all works, slower
  }
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T& operator[](std::size_t k) { return data_.get()[k]; }
  const T& operator[](std::size_t k) const { return data_.get()[k]; }

 private:
  static constexpr std::size_t kCacheLine = 64;
  static constexpr std::size_t kHugePage = std::size_t{2} << 20;  // less would waste the rest of one
  struct Free {
    void operator()(T* p) const { std::free(p); }
  };
  std::unique_ptr<T, Free> data_;
  std::size_t size_ = 0;
};

}  // namespace patchwork
