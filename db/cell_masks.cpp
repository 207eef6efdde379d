#include "db/cell_masks.h"

#include <algorithm>

namespace patchwork {

namespace {

// Marks cells without data that are joined to the border, by a flood from there over edges. Whole runs of a
// row wait to be looked around from, not cells: a ragged survey has a thousand times fewer of these.
class Flood {
 public:
  Flood(std::vector<std::uint8_t>& cells, int cols, int rows) : cells_(cells), cols_(cols), rows_(rows) {}

  void run() {
    for (const int j : {0, rows_ - 1}) enter(j, 0, cols_ - 1);
    for (int j = 0; j < rows_; ++j) enter(j, 0, 0), enter(j, cols_ - 1, cols_ - 1);
    while (!open_.empty()) {
      const Run r = open_.back();
      open_.pop_back();
      for (const int j : {r.row - 1, r.row + 1})
        if (j >= 0 && j < rows_) enter(j, r.from, r.to);
    }
  }

 private:
  struct Run {
    int row, from, to;  // the last cell included
  };

  // The runs that have a cell in [from, to].
  void enter(int j, int from, int to) {
    std::uint8_t* const row = cells_.data() + std::size_t(j) * std::size_t(cols_);
    for (int i = from; i <= to; ++i) {
      if (row[i] != 0) continue;
      Run r{j, i, i};
      while (r.from > 0 && row[r.from - 1] == 0) --r.from;
      while (r.to + 1 < cols_ && row[r.to + 1] == 0) ++r.to;
      std::fill(row + r.from, row + r.to + 1, CellMasks::kOutside);
      open_.push_back(r);
      i = r.to;
    }
  }

  std::vector<std::uint8_t>& cells_;
  const int cols_, rows_;
  std::vector<Run> open_;
};

}  // namespace

CellMasks CellMasks::from_cells(std::vector<std::uint8_t> cells, const GridShape& shape) {
  CellMasks masks;
  for (std::uint8_t& c : cells) c = c ? kReal | kAnswering : 0;
  Flood(cells, shape.width() - 1, shape.height() - 1).run();
  masks.levels_.push_back({shape.width() - 1, shape.height() - 1, std::move(cells)});
  for (int l = 1; l < shape.levels(); ++l) {
    const int cols = shape.lattice_cols(l) - 1, rows = shape.lattice_rows(l) - 1;
    Level level{cols, rows, std::vector<std::uint8_t>(size_t(cols) * size_t(rows))};
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < cols; ++i) {
        std::uint8_t all = kReal, any = 0;
        for (int y = 2 * j; y < std::min(2 * j + 2, masks.rows(l - 1)); ++y)
          for (int x = 2 * i; x < std::min(2 * i + 2, masks.cols(l - 1)); ++x)
            all &= masks.at(l - 1, x, y), any |= masks.at(l - 1, x, y);
        level.cells[size_t(j) * size_t(cols) + size_t(i)] =
            std::uint8_t((all & kReal) | (any & (kAnswering | kOutside)));
      }
    masks.levels_.push_back(std::move(level));
  }
  return masks;
}

}  // namespace patchwork
