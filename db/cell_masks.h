// Which cells of a grid hold data, at every level.
#pragma once

#include <cstdint>
#include <vector>

#include "db/grid_shape.h"

namespace patchwork {

/// Which cells of every level hold data (design: model, section 2, holes). Empty for a grid without holes.
class CellMasks {
 public:
  /// kOutside: without data and joined to the grid's border by others like it (a ragged or warped survey's
  /// surroundings); holes inside a survey are often single cells, and it should fade towards them over less.
  /// kVertex, in stored chunks of level 0 only: the sample at which the cell starts holds data (one without a
  /// whole cell around it has no surface, but goes back to whoever wants the grid's samples).
  enum Cell : std::uint8_t { kReal = 1, kAnswering = 2, kOutside = 4, kVertex = 8 };
  bool empty() const { return levels_.empty(); }
  int cols(int level) const { return levels_[size_t(level)].cols; }
  int rows(int level) const { return levels_[size_t(level)].rows; }
  const std::uint8_t* row(int level, int j) const {
    const Level& l = levels_[size_t(level)];
    return l.cells.data() + size_t(j) * size_t(l.cols);
  }
  std::uint8_t at(int level, int i, int j) const { return row(level, j)[i]; }
  /// Level-0 cells (1 = valid), (width - 1) x (height - 1), and from them all others.
  static CellMasks from_cells(std::vector<std::uint8_t> cells, const GridShape& shape);

 private:
  struct Level {
    int cols, rows;
    std::vector<std::uint8_t> cells;
  };
  std::vector<Level> levels_;
};

}  // namespace patchwork
