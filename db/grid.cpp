#include "db/grid.h"

#include <algorithm>
#include <cmath>

namespace patchwork {

BlockRange blocks_near(const GridInfo& grid, int level, const Extent& extent) {
  const LatticeRect r = grid.frame.lattice_bounds(extent.corners());
  const double side = std::ldexp(kKernelCells, level), slack = 1;  // a cell is more than all rounding
  const auto block = [&](double v, int n) {
    return int(std::clamp(std::floor(v / side), 0.0, double(n - 1)));
  };
  const int ni = grid.shape.blocks_i(level), nj = grid.shape.blocks_j(level);
  return {block(r.i0 - slack, ni), block(r.j0 - slack, nj), block(r.i1 + slack, ni), block(r.j1 + slack, nj)};
}

}  // namespace patchwork
