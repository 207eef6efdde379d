#include "db/grid_shape.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

namespace patchwork {

namespace {

// Level-0 cells along a cell of the level.
double cell_side(int level) { return double(std::uint64_t{1} << level); }

}  // namespace

GridShape::GridShape(int width, int height, bool pixel_is_area)
    : width_(width), height_(height), pad_(pixel_is_area ? 0.5 : 0.0) {
  assert(width >= 2 && height >= 2);
  const LatticeRect f = footprint();
  // At most a quarter of a side is given to the feather, so that the smallest grid keeps a kernel.
  const double fi = std::min<double>(kFeatherCells, (f.i1 - f.i0) / 4);
  const double fj = std::min<double>(kFeatherCells, (f.j1 - f.j0) / 4);
  core_ = {f.i0 + fi, f.j0 + fj, f.i1 - fi, f.j1 - fj};
  for (int level = 0;; ++level) {
    const double side = kKernelCells * cell_side(level);
    const Level l{int(std::ceil(core_.i1 / side)), int(std::ceil(core_.j1 / side)), blocks_};
    levels_.push_back(l);
    blocks_ += size_t(l.bi) * size_t(l.bj);
    if (l.bi == 1 && l.bj == 1) break;
  }
}

LatticeRect GridShape::kernel(int level, int bx, int by) const {
  const double side = kKernelCells * cell_side(level);
  return {std::max(core_.i0, bx * side), std::max(core_.j0, by * side), std::min(core_.i1, (bx + 1) * side),
          std::min(core_.j1, (by + 1) * side)};
}

LatticeRect GridShape::domain(int level, int bx, int by) const {
  const double side = kKernelCells * cell_side(level), rim = kExtensionCells * cell_side(level);
  const LatticeRect f = footprint();
  // Behind the last block lies at most a feather, which no other patch would answer.
  const auto end = [&](int b, int blocks, double last) {
    return b + 1 == blocks ? last : std::min(last, (b + 1) * side + rim);
  };
  return {std::max(f.i0, bx * side - rim), std::max(f.j0, by * side - rim), end(bx, blocks_i(level), f.i1),
          end(by, blocks_j(level), f.j1)};
}

std::size_t GridShape::index(int level, int bx, int by) const {
  const Level& l = levels_[size_t(level)];
  const int tx = bx / kTile * kTile, ty = by / kTile * kTile;  // the tile's first block
  const int width = std::min(kTile, l.bi - tx), height = std::min(kTile, l.bj - ty);
  const int before = ty * l.bi + tx * height;
  return l.first + size_t(before + (by - ty) * width + (bx - tx));
}

GridShape::Block GridShape::block(std::size_t index) const {
  int level = 0;
  while (level + 1 < levels() && index >= levels_[size_t(level) + 1].first) ++level;
  const Level& l = levels_[size_t(level)];
  const int k = int(index - l.first);
  const int ty = k / (kTile * l.bi) * kTile, height = std::min(kTile, l.bj - ty);
  const int in_row = k - ty * l.bi, tx = in_row / (kTile * height) * kTile;
  const int in_tile = in_row - tx * height, width = std::min(kTile, l.bi - tx);
  return {level, tx + in_tile % width, ty + in_tile / width};
}

}  // namespace patchwork
