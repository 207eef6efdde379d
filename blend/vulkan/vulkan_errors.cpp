// VulkanBlend's block errors: the tile evaluated more densely, and one pass over it.
#include <cassert>

#include "blend/vulkan/vulkan_blend_impl.h"

namespace patchwork {

namespace {

constexpr int kCells = 8;  // block_errors.comp

// `fine` times as dense: vertex (c, r) becomes (fine c, fine r).
RasterFrame refined(const RasterFrame& f, int fine) {
  return {f.x0, f.xc / fine, f.xr / fine, f.y0, f.yc / fine, f.yr / fine};
}

}  // namespace

void VulkanBlend::block_errors(const RasterFrame& lattice, std::span<const Tile> tiles, int side, int fine,
                               const std::function<void(const TileErrors&)>& take) const {
  assert(side % kCells == 1 && fine > 0);
  const int dense = fine * (side - 1) + 1, across = (side - 1) / kCells;
  std::vector<Tile> refined_tiles;
  for (const Tile& t : tiles) {
    assert(t.across == side && t.down == side);
    refined_tiles.push_back({t.c0 * fine, t.r0 * fine, t.stride, dense, dense});
  }
  const RasterFrame frame = refined(lattice, fine);
  impl_->run(
      frame, refined_tiles, dense,
      [&](const TileBins& bins) {
        vk::Work work = impl_->tile_work(frame, bins, dense, {.source = false});
        work.push.exact_rim = 0, work.push.fine = std::uint32_t(fine);
        work.push.errors_at = std::uint32_t(work.result_words), work.read_from = work.result_words;
        work.result_words += bins.tiles.size() * std::size_t(across) * std::size_t(across) * 3;
        return work;
      },
      [&](const vk::Frame& submission, std::size_t first, std::size_t count) {
        const auto words = submission.results();
        take({first, count, across, {reinterpret_cast<const float*>(words.data()), words.size()}});
      });
}

}  // namespace patchwork
