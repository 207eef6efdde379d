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

// A number for each cell of a window and of what can fade it. One more cell stands around these, which
// nothing changes; rows are as long as vectors like them.
class Plane {
 public:
  static constexpr int kMargin = kFeatherCells + kSplineReach, kSpan = kSide + 2 * kMargin, kRow = 64;
  static_assert(kSpan <= kRow);
  explicit Plane(std::uint8_t all) { values_.fill(all); }

  /// Rows and columns of the window, -kMargin to kSide + kMargin.
  std::uint8_t* row(int b) { return values_.data() + (b + kMargin + 1) * kStride + 1 + kMargin; }
  const std::uint8_t* row(int b) const { return const_cast<Plane*>(this)->row(b); }

  /// to[a] = of(row b, a), all along a row.
  template <class Of>
  static void fill_row(std::uint8_t* to, Of of) {
    for (int a = -kMargin; a < kRow - kMargin; ++a) to[a] = of(a);
  }

 private:
  static constexpr int kStride = kRow + 2;
  std::array<std::uint8_t, (kSpan + 2) * kStride> values_;
};

std::uint8_t lesser(std::uint8_t a, std::uint8_t b) { return a < b ? a : b; }

// Of each cell the least of those from `before` cells before it to `after` cells behind it, along both axes.
// Nearer than these to the rim of the plane it means nothing.
Plane least(const Plane& of, int before, int after) {
  Plane along(kFeatherCells), out(kFeatherCells);
  const int first = -Plane::kMargin, end = kSide + Plane::kMargin;
  for (int b = first; b < end; ++b)
    for (int d = -before; d <= after; ++d) {
      const std::uint8_t* from = of.row(b) + d;
      std::uint8_t* to = along.row(b);
      Plane::fill_row(to, [&](int a) { return lesser(to[a], from[a]); });
    }
  for (int b = first + before; b < end - after; ++b)
    for (int d = -before; d <= after; ++d) {
      const std::uint8_t* from = along.row(b + d);
      std::uint8_t* to = out.row(b);
      Plane::fill_row(to, [&](int a) { return lesser(to[a], from[a]); });
    }
  return out;
}

// Where a plane is 0 it stays so; elsewhere it becomes `part` times the Chebyshev distance from there, in
// cells, kFeatherCells at most.
void spread(Plane& plane, int part) {
  Plane along(kFeatherCells);
  for (int reached = part; reached < kFeatherCells; reached += part) {
    for (int b = -Plane::kMargin; b < kSide + Plane::kMargin; ++b) {
      const std::uint8_t* from = plane.row(b);
      Plane::fill_row(along.row(b), [&](int a) { return lesser(lesser(from[a - 1], from[a]), from[a + 1]); });
    }
    for (int b = -Plane::kMargin; b < kSide + Plane::kMargin; ++b) {
      const std::uint8_t *above = along.row(b - 1), *here = along.row(b), *below = along.row(b + 1);
      std::uint8_t* to = plane.row(b);
      Plane::fill_row(to, [&](int a) {
        return lesser(to[a], std::uint8_t(lesser(lesser(above[a], here[a]), below[a]) + part));
      });
    }
  }
}

// Cells of a window and of what can fade it, with the distance of each from those without data.
class Surroundings {
 public:
  Surroundings(const CellSource& cells, int level, int first_i, int first_j) {
    constexpr int m = Plane::kMargin;
    std::uint8_t common = CellMasks::kReal;
    for (int b = -m; b < kSide + m; ++b) {
      std::uint8_t* row = bits_.row(b) - m;
      cells.row(first_i - m, first_j + b, {row, size_t(Plane::kSpan)});
      for (int a = 0; a < Plane::kSpan; ++a) common &= row[a];
    }
    whole_ = common != 0;
    if (whole_) return;
    Plane hole(kFeatherCells);
    for (int b = -m; b < kSide + m; ++b) {
      const std::uint8_t* from = bits_.row(b);
      std::uint8_t *border = far_.row(b), *inside = hole.row(b);
      for (int a = -m; a < kSide + m; ++a) {
        const bool real = from[a] & CellMasks::kReal, outside = from[a] & CellMasks::kOutside;
        border[a] = outside ? 0 : kFeatherCells, inside[a] = real || outside ? kFeatherCells : 0;
      }
    }
    spread(far_, part_a_cell(level, kFeatherCells)), spread(hole, part_a_cell(level, kHoleFeatherCells));
    for (int b = -m; b < kSide + m; ++b) {
      std::uint8_t *to = far_.row(b), *inside = hole.row(b);
      Plane::fill_row(to, [&](int a) { return lesser(to[a], inside[a]); });
    }
  }
  bool whole() const { return whole_; }
  /// CellMasks::Cell bits.
  const Plane& bits() const { return bits_; }
  /// 0 for a cell without data, up to kFeatherCells a feather away from any.
  const Plane& far() const { return far_; }

 private:
  bool whole_ = true;
  Plane bits_{0}, far_{kFeatherCells};
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
  const Plane near = least(around.far(), 1, 0),
              wide = least(near, 1, 1);  // a vertex has four cells around it
  for (int b = 0; b < kSide; ++b) {
    const auto k = size_t(b * kSide);
    const std::uint8_t* bits = around.bits().row(b);
    for (int a = 0; a < kSide; ++a) {
      holes->answering[k + size_t(a)] = (bits[a] & CellMasks::kAnswering) != 0;
      holes->real[k + size_t(a)] = (bits[a] & CellMasks::kReal) != 0;
    }
    std::copy_n(near.row(b), kSide, holes->near.begin() + long(k));
    std::copy_n(wide.row(b), kSide, holes->wide.begin() + long(k));
  }
  return holes;
}

Offer make_offer(const CellSource& cells, int level, int bx, int by) {
  std::array<std::array<bool, kKernelCells>, kKernelCells> free;
  const Surroundings around(cells, level, bx * kKernelCells, by * kKernelCells);
  // Nothing that an interpolated weight in such a cell reads is faded.
  const Plane read = least(around.far(), kSplineReach, kSplineReach);
  for (int j = 0; j < kKernelCells; ++j)
    for (int i = 0; i < kKernelCells; ++i) free[size_t(j)][size_t(i)] = read.row(j)[i] == kFeatherCells;
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
