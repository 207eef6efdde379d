#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "tools/terrain_function.h"

namespace patchwork {

namespace {

constexpr std::size_t kRefinedCells = 4096;
constexpr std::size_t kLeastPerRow =
    16;                          // candidates each row offers, so that one bad row does not hide another
constexpr int kStrip = 16;       // rows screened together, so that they share their vertices
constexpr int kRefinement = 16;  // samples along each side of a refined cell

// A cell and the distance at its sampled points, so far.
struct Cell {
  int i = 0, j = 0;
  double error = 0;
};

// Worst first; ties by place, so that the choice does not depend on threads.
bool worse(const Cell& a, const Cell& b) {
  return a.error != b.error ? a.error > b.error : a.j != b.j ? a.j < b.j : a.i < b.i;
}

void keep_worst(std::vector<Cell>& cells, std::size_t count) {
  if (cells.size() <= count) return;
  std::nth_element(cells.begin(), cells.begin() + std::ptrdiff_t(count), cells.end(), worse);
  cells.resize(count);
}

class Measure {
 public:
  Measure(const HeightField& field, const Frame& frame, int width, int height)
      : field_(field), frame_(frame), width_(width), height_(height) {}

  // The field at lattice points (i0 + k, j), k = 0 .. count - 1.
  std::vector<double> row(double i0, double j, int count) const {
    std::vector<double> x(std::size_t(count), 0.), y = x, h = x;
    for (int k = 0; k < count; ++k) {
      const Point p = frame_.to_domain(i0 + k, j);
      x[std::size_t(k)] = p.x, y[std::size_t(k)] = p.y;
    }
    field_.heights(x, y, h);
    return h;
  }

  // The cells of rows [j0, j1) that are worst at their centres, the worst of each row.
  std::vector<Cell> screen_rows(int j0, int j1, std::size_t keep) const {
    std::vector<Cell> worst, cells;
    std::vector<double> above = row(0, j0, width_), below;
    for (int j = j0; j < j1; ++j, above.swap(below)) {
      below = row(0, j + 1, width_);
      const std::vector<double> centre = row(0.5, j + 0.5, width_ - 1);
      cells.resize(centre.size());
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const double bilinear = 0.25 * (above[i] + above[i + 1] + below[i] + below[i + 1]);
        cells[i] = {int(i), j, std::abs(centre[i] - bilinear)};
      }
      keep_worst(cells, keep);
      worst.insert(worst.end(), cells.begin(), cells.end());
    }
    return worst;
  }

  double refine(const Cell& cell) const {
    const std::vector<double> above = row(cell.i, cell.j, 2), below = row(cell.i, cell.j + 1, 2);
    std::array<double, kRefinement> x, y, h;
    double worst = cell.error;
    for (int b = 0; b < kRefinement; ++b) {
      const double v = (b + 0.5) / kRefinement;
      const double left = above[0] + v * (below[0] - above[0]), right = above[1] + v * (below[1] - above[1]);
      for (int a = 0; a < kRefinement; ++a) {
        const Point p = frame_.to_domain(cell.i + (a + 0.5) / kRefinement, cell.j + v);
        x[std::size_t(a)] = p.x, y[std::size_t(a)] = p.y;
      }
      field_.heights(x, y, h);
      for (int a = 0; a < kRefinement; ++a)
        worst =
            std::max(worst, std::abs(h[std::size_t(a)] - left - (a + 0.5) / kRefinement * (right - left)));
    }
    return worst;
  }

  std::vector<Cell> screen() const {
    const int rows = height_ - 1, strips = (rows + kStrip - 1) / kStrip;
    const std::size_t keep = std::max(kLeastPerRow, kRefinedCells / std::size_t(rows) + 1);
    std::vector<std::vector<Cell>> kept{std::size_t(strips), std::vector<Cell>{}};
    tbb::parallel_for(0, strips, [&](int s) {
      kept[std::size_t(s)] = screen_rows(s * kStrip, std::min(rows, (s + 1) * kStrip), keep);
    });
    std::vector<Cell> cells;
    for (const std::vector<Cell>& part : kept) cells.insert(cells.end(), part.begin(), part.end());
    keep_worst(cells, kRefinedCells);
    return cells;
  }

 private:
  const HeightField& field_;
  const Frame& frame_;
  int width_, height_;
};

}  // namespace

// One sample in every cell finds where the surface is worst; only there is it sampled densely. A dense sample
// of every cell would cost 256 evaluations a cell where this costs two.
double interpolation_error(const HeightField& field, const Frame& frame, int width, int height) {
  const Measure measure(field, frame, width, height);
  std::vector<Cell> cells = measure.screen();
  tbb::parallel_for(std::size_t{0}, cells.size(),
                    [&](std::size_t k) { cells[k].error = measure.refine(cells[k]); });
  double worst = 0;
  for (const Cell& cell : cells) worst = std::max(worst, cell.error);
  return kInterpolationMargin * worst;
}

}  // namespace patchwork
