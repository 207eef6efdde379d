#include "db/patch_surface.h"

#include <algorithm>
#include <vector>

#include "db/cell_masks.h"

namespace patchwork {

namespace {

constexpr int kSide = PatchSurface::kSide;

// A cubic B-spline over a vertex reads cells up to three away.
constexpr int kSplineReach = 3;

// Parts of kFeatherCells that a cell's distance counts: feathers are the same in metres at every level, a
// cell at least.
int part_a_cell(int level, int feather) { return kFeatherCells / std::max(1, feather >> std::min(level, 8)); }

// Cells of a window and of what can fade it, with the distance of each from those without data.
class Surroundings {
 public:
  static constexpr int kMargin = kFeatherCells + kSplineReach, kSpan = kSide + 2 * kMargin;
  Surroundings(const CellSource& cells, int level, int first_i, int first_j) {
    for (int b = 0; b < kSpan; ++b)
      for (int a = 0; a < kSpan; ++a) {
        const auto k = size_t(b * kSpan + a);
        bits_[k] = cells.cell(first_i - kMargin + a, first_j - kMargin + b);
        const bool real = bits_[k] & CellMasks::kReal, outside = bits_[k] & CellMasks::kOutside;
        border_[k] = outside ? 0 : kFeatherCells;
        hole_[k] = real || outside ? kFeatherCells : 0;
        whole_ &= real;
      }
    if (whole_) return;
    spread(border_, part_a_cell(level, kFeatherCells));
    spread(hole_, part_a_cell(level, kHoleFeatherCells));
  }
  bool whole() const { return whole_; }
  std::uint8_t at(int a, int b) const { return bits_[place(a, b)]; }
  /// 0 for a cell without data, up to kFeatherCells a feather away from any.
  int far(int a, int b) const { return std::min(border_[place(a, b)], hole_[place(a, b)]); }
  /// `far` of a vertex: the least of the cells around it.
  int vertex(int a, int b) const {
    return std::min({far(a - 1, b - 1), far(a, b - 1), far(a - 1, b), far(a, b)});
  }
  /// Nothing that an interpolated weight in this cell reads is faded.
  bool full_weight(int a, int b) const {
    for (int y = b - kSplineReach; y <= b + kSplineReach; ++y)
      for (int x = a - kSplineReach; x <= a + kSplineReach; ++x)
        if (far(x, y) < kFeatherCells) return false;
    return true;
  }

 private:
  using Plane = std::array<std::uint8_t, kSpan * kSpan>;
  static std::size_t place(int a, int b) { return size_t((b + kMargin) * kSpan + a + kMargin); }
  // Chebyshev distance in two sweeps, `part` a cell.
  static void spread(Plane& plane, int part) {
    const auto lower = [&](int a, int b, int da, int db) {
      const int x = a + da, y = b + db;
      if (x < 0 || y < 0 || x >= kSpan || y >= kSpan) return;
      std::uint8_t& here = plane[size_t(b * kSpan + a)];
      here = std::min<std::uint8_t>(here, std::uint8_t(plane[size_t(y * kSpan + x)] + part));
    };
    for (int b = 0; b < kSpan; ++b)
      for (int a = 0; a < kSpan; ++a)
        lower(a, b, -1, 0), lower(a, b, -1, -1), lower(a, b, 0, -1), lower(a, b, 1, -1);
    for (int b = kSpan; b-- > 0;)
      for (int a = kSpan; a-- > 0;)
        lower(a, b, 1, 0), lower(a, b, 1, 1), lower(a, b, 0, 1), lower(a, b, -1, 1);
  }
  bool whole_ = true;
  Plane bits_, border_, hole_;
};

struct CellRect {
  int i0, j0, i1, j1;
  int area() const { return (i1 - i0) * (j1 - j0); }
};

// The largest rectangle of set cells: for every cell as lower right corner, by the heights of the columns
// above it.
CellRect largest_rectangle(const std::array<std::array<bool, kKernelCells>, kKernelCells>& free) {
  CellRect best{0, 0, 0, 0};
  std::array<int, kKernelCells> height{};
  for (int j = 0; j < kKernelCells; ++j)
    for (int i = 0; i < kKernelCells; ++i) {
      height[size_t(i)] = free[size_t(j)][size_t(i)] ? height[size_t(i)] + 1 : 0;
      int low = height[size_t(i)];
      for (int k = i; k >= 0 && low > 0; --k) {
        low = std::min(low, height[size_t(k)]);
        const CellRect r{k, j + 1 - low, i + 1, j + 1};
        if (r.area() > best.area()) best = r;
      }
    }
  return best;
}

}  // namespace

std::unique_ptr<const PatchSurface::Holes> make_holes(const CellSource& cells, int level, int bx, int by) {
  const Surroundings around(cells, level, bx * kKernelCells - kExtensionCells - 1,
                            by * kKernelCells - kExtensionCells - 1);
  if (around.whole()) return nullptr;
  auto holes = std::make_unique<PatchSurface::Holes>();
  for (int b = 0; b < kSide; ++b)
    for (int a = 0; a < kSide; ++a) {
      const auto k = size_t(b * kSide + a);
      holes->answering[k] = (around.at(a, b) & CellMasks::kAnswering) != 0;
      holes->real[k] = (around.at(a, b) & CellMasks::kReal) != 0;
      holes->near[k] = std::uint8_t(around.vertex(a, b));
      int wide = kFeatherCells;
      for (int y = b - 1; y <= b + 1; ++y)
        for (int x = a - 1; x <= a + 1; ++x) wide = std::min(wide, around.vertex(x, y));
      holes->wide[k] = std::uint8_t(wide);
    }
  return holes;
}

Offer make_offer(const CellSource& cells, int level, int bx, int by) {
  std::array<std::array<bool, kKernelCells>, kKernelCells> free;
  const Surroundings around(cells, level, bx * kKernelCells, by * kKernelCells);
  for (int j = 0; j < kKernelCells; ++j)
    for (int i = 0; i < kKernelCells; ++i) free[size_t(j)][size_t(i)] = around.full_weight(i, j);
  Offer offer;
  while (offer.count < offer.cells.size()) {
    const CellRect r = largest_rectangle(free);
    if (r.area() == 0) break;
    offer.cells[offer.count++] = {std::uint8_t(r.i0), std::uint8_t(r.j0), std::uint8_t(r.i1),
                                  std::uint8_t(r.j1)};
    for (int j = r.j0; j < r.j1; ++j)
      for (int i = r.i0; i < r.i1; ++i) free[size_t(j)][size_t(i)] = false;
  }
  return offer;
}

}  // namespace patchwork
