#include "db/patch_surface.h"

#include <algorithm>
#include <vector>

#include "db/ingest.h"

namespace patchwork {

namespace {

constexpr int kSide = PatchSurface::kSide;

// Cells of the window and kHoleFadeCells around it, as one array.
class Surroundings {
 public:
  static constexpr int kMargin = kHoleFadeCells, kSpan = kSide + 2 * kMargin;
  Surroundings(const CellSource& cells, int first_i, int first_j) {
    for (int b = 0; b < kSpan; ++b)
      for (int a = 0; a < kSpan; ++a)
        bits_[size_t(b * kSpan + a)] = cells.cell(first_i - kMargin + a, first_j - kMargin + b);
  }
  std::uint8_t at(int a, int b) const { return bits_[size_t((b + kMargin) * kSpan + a + kMargin)]; }
  bool all_real(int a0, int b0, int a1, int b1) const {
    for (int b = b0; b <= b1; ++b)
      for (int a = a0; a <= a1; ++a)
        if (!(at(a, b) & CellMasks::kReal)) return false;
    return true;
  }

 private:
  std::array<std::uint8_t, kSpan * kSpan> bits_;
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

std::unique_ptr<const PatchSurface::Holes> make_holes(const CellSource& cells, int bx, int by) {
  const Surroundings around(cells, bx * kKernelCells - kExtensionCells - 1,
                            by * kKernelCells - kExtensionCells - 1);
  constexpr int m = Surroundings::kMargin;
  if (around.all_real(-m, -m, kSide - 1 + m, kSide - 1 + m)) return nullptr;
  auto holes = std::make_unique<PatchSurface::Holes>();
  for (int b = 0; b < kSide; ++b)
    for (int a = 0; a < kSide; ++a) {
      const auto k = size_t(b * kSide + a);
      holes->answering[k] = (around.at(a, b) & CellMasks::kAnswering) != 0;
      holes->real[k] = (around.at(a, b) & CellMasks::kReal) != 0;
      holes->near[k] = around.all_real(a - 1, b - 1, a, b);
      holes->wide[k] = around.all_real(a - 2, b - 2, a + 1, b + 1);
    }
  return holes;
}

Offer make_offer(const CellSource& cells, int bx, int by) {
  std::array<std::array<bool, kKernelCells>, kKernelCells> free;
  const Surroundings around(cells, bx * kKernelCells, by * kKernelCells);
  constexpr int m = kHoleFadeCells;
  for (int j = 0; j < kKernelCells; ++j)
    for (int i = 0; i < kKernelCells; ++i)
      free[size_t(j)][size_t(i)] = around.all_real(i - m, j - m, i + m, j + m);
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
