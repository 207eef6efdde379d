#include "db/cell_masks.h"

#include <algorithm>
#include <utility>

namespace patchwork {

namespace {

// Marks cells without data that are joined to the border, by a flood from there over edges.
void mark_outside(std::vector<std::uint8_t>& cells, int cols, int rows) {
  std::vector<std::pair<int, int>> open;
  const auto enter = [&](int i, int j) {
    if (i < 0 || j < 0 || i >= cols || j >= rows) return;
    std::uint8_t& c = cells[size_t(j) * size_t(cols) + size_t(i)];
    if (c == 0) c = CellMasks::kOutside, open.emplace_back(i, j);
  };
  for (int i = 0; i < cols; ++i) enter(i, 0), enter(i, rows - 1);
  for (int j = 0; j < rows; ++j) enter(0, j), enter(cols - 1, j);
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    enter(i - 1, j), enter(i + 1, j), enter(i, j - 1), enter(i, j + 1);
  }
}

}  // namespace

CellMasks CellMasks::from_cells(std::vector<std::uint8_t> cells, const GridShape& shape) {
  CellMasks masks;
  for (std::uint8_t& c : cells) c = c ? kReal | kAnswering : 0;
  mark_outside(cells, shape.width() - 1, shape.height() - 1);
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
