#include "db/grid.h"

#include <algorithm>
#include <cmath>

namespace patchwork {

BlockRange blocks_near(const GridInfo& grid, int level, const Extent& extent) {
  double i0 = INFINITY, j0 = INFINITY, i1 = -INFINITY, j1 = -INFINITY;
  for (const double x : {extent.xmin, extent.xmax})
    for (const double y : {extent.ymin, extent.ymax}) {
      const Point p = grid.frame.to_lattice(x, y);
      i0 = std::min(i0, p.x), i1 = std::max(i1, p.x), j0 = std::min(j0, p.y), j1 = std::max(j1, p.y);
    }
  const double side = std::ldexp(kKernelCells, level), slack = 1;  // a cell is more than all rounding
  const auto block = [&](double v, int n) {
    return int(std::clamp(std::floor(v / side), 0.0, double(n - 1)));
  };
  const int ni = grid.shape.blocks_i(level), nj = grid.shape.blocks_j(level);
  return {block(i0 - slack, ni), block(j0 - slack, nj), block(i1 + slack, ni), block(j1 + slack, nj)};
}

}  // namespace patchwork
