// Patches as they are evaluated: their windows, the distance to holes, and what they offer as cover.
#include "db/patch_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "db/cell_masks.h"
#include "db/lattice.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

double rough(int i, int j) {
  return std::round(200 * std::sin(0.2 * i) * std::cos(0.15 * j) + (i * 7 + j * 13) % 29);
}

TEST(PatchSurface, ItsWindowHoldsTheLevelsVerticesContinuedLinearlyBeyondTheGrid) {
  for (const auto& [w, h] : std::vector<std::pair<int, int>>{{2, 3}, {40, 31}, {131, 240}})
    for (const bool area : {false, true}) {
      const GridFolder folder;
      Database db = folder.database();
      folder.add(db, {.width = w, .height = h, .pixel_is_area = area, .type = GDT_Int16, .at = rough},
                 "grid");
      const Grid& g = db.grids()[0];
      std::vector<Lattice> levels;
      for (int l = 0; l < g.info.shape.levels(); ++l)
        levels.push_back(make_lattice(g.info.shape, l, 0, g.info.shape.lattice_rows(l), rough));
      each_patch(g, [&](std::size_t k, GridShape::Block b) {
        const auto s = db.surface(g.patch_id(k));
        const Lattice& l = levels[size_t(b.level)];
        EXPECT_EQ(s->holes, nullptr);
        EXPECT_EQ(s->kernel.i0, g.info.shape.kernel(b.level, b.bx, b.by).i0);
        int reads = 0;
        for (int v = 0; v < PatchSurface::kSide; ++v)
          for (int u = 0; u < PatchSurface::kSide; ++u) {
            const int c = int(s->first_i) + u, r = int(s->first_j) + v;
            if (c < -2 || r < -2 || c > l.cols() + 1 || r > l.rows() + 1) continue;
            ASSERT_EQ(s->codes[size_t(v * PatchSurface::kSide + u)] + double(g.info.code_origin), l.row(r)[c])
                << b.level << ": " << c << ", " << r;
            ++reads;
          }
        EXPECT_GT(reads, 8);
        // An interpolant at either end of the domain reads one vertex before its cell and two behind.
        const double step = std::ldexp(1, b.level);
        EXPECT_GE(std::floor(s->domain.i0 / step) - 1, s->first_i);
        EXPECT_LE(std::ceil(s->domain.i1 / step) + 1, s->first_i + PatchSurface::kSide - 1);
        EXPECT_LE(std::ceil(s->domain.j1 / step) + 1, s->first_j + PatchSurface::kSide - 1);
      });
    }
}

// Cells of a plane with random ones missing; beyond the stored ones all is real.
class RandomCells : public CellSource {
 public:
  RandomCells(double missing, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::bernoulli_distribution hole(missing);
    for (std::uint8_t& b : bits_) b = hole(random) ? kBroken[random() % 4] : kWhole;
  }
  void row(int i, int j, std::span<std::uint8_t> out) const override {
    for (std::uint8_t& c : out) c = cell(i++, j);
  }
  std::uint8_t cell(int i, int j) const {
    return i < -kFrom || j < -kFrom || i >= kSpan - kFrom || j >= kSpan - kFrom
               ? kWhole
               : bits_[size_t((j + kFrom) * kSpan + i + kFrom)];
  }
  bool real(int i, int j) const { return cell(i, j) & CellMasks::kReal; }

 private:
  static constexpr int kFrom = 20, kSpan = 110;
  static constexpr std::uint8_t kBroken[] = {0, CellMasks::kAnswering, CellMasks::kOutside,
                                             CellMasks::kAnswering | CellMasks::kOutside};
  static constexpr std::uint8_t kWhole = CellMasks::kReal | CellMasks::kAnswering;
  std::array<std::uint8_t, kSpan * kSpan> bits_;
};

// How far vertex (i, j) is from cells without data: 0 at one, kFeatherCells where the weight is full.
int brute_near(const RandomCells& cells, int level, int i, int j) {
  const auto feather = [level](int cells_of_level0) { return std::max(1, cells_of_level0 >> level); };
  int least = kFeatherCells;
  for (int d = 0; d < kFeatherCells; ++d)
    for (int y = j - 1 - d; y <= j + d; ++y)
      for (int x = i - 1 - d; x <= i + d; ++x) {
        if (cells.real(x, y)) continue;
        const bool outside = cells.cell(x, y) & CellMasks::kOutside;
        least = std::min(least, d * (kFeatherCells / feather(outside ? kFeatherCells : kHoleFeatherCells)));
      }
  return least;
}

int brute_wide(const RandomCells& cells, int level, int i, int j) {
  int least = kFeatherCells;
  for (int y = j - 1; y <= j + 1; ++y)
    for (int x = i - 1; x <= i + 1; ++x) least = std::min(least, brute_near(cells, level, x, y));
  return least;
}

TEST(PatchSurface, HolesKnowEveryCellAndHowFarFromHolesEveryVertexIs) {
  const std::uint64_t seed = test_seed(1);
  std::array<int, kFeatherCells + 1> seen{};
  for (const double missing : {0.0005, 0.01, 0.3})
    for (int level = 0; level < 5; ++level)
      for (int n = 0; n < 2; ++n) {
        const RandomCells cells(missing, seed + std::uint64_t(n));
        const auto holes = make_holes(cells, level, n, 1);
        if (!holes) continue;
        for (int v = 0; v < PatchSurface::kSide; ++v)
          for (int u = 0; u < PatchSurface::kSide; ++u) {
            const int i = n * kKernelCells - kExtensionCells - 1 + u,
                      j = kKernelCells - kExtensionCells - 1 + v;
            const auto k = size_t(v * PatchSurface::kSide + u);
            ASSERT_EQ(holes->real[k], cells.real(i, j));
            ASSERT_EQ(holes->answering[k], (cells.cell(i, j) & CellMasks::kAnswering) != 0);
            ASSERT_EQ(holes->near[k], brute_near(cells, level, i, j)) << level << ": " << i << ", " << j;
            ++seen[holes->near[k]];
            if ((u + v) % 5 == 0) {
              ASSERT_EQ(holes->wide[k], brute_wide(cells, level, i, j)) << level << ": " << i << ", " << j;
            }
          }
      }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 0), 0) << "every distance was met";
}

TEST(PatchSurface, AWindowWithoutHolesNearItHasNone) {
  EXPECT_EQ(make_holes(RandomCells(0, 1), 0, 0, 0), nullptr);
  EXPECT_NE(make_holes(RandomCells(0.01, 1), 0, 0, 0), nullptr);
}

TEST(PatchSurface, AnOfferIsAtMostEightDisjointRectanglesOfCellsAtFullWeight) {
  const std::uint64_t seed = test_seed(2);
  int offered = 0, real_but_not_offered = 0;
  for (const double missing : {0.0003, 0.001, 0.004, 0.3})
    for (int level = 0; level < 5; ++level)
      for (int n = 0; n < 3; ++n) {
        const RandomCells cells(missing, seed + std::uint64_t(n));
        const Offer offer = make_offer(cells, level, 1, 1);
        ASSERT_LE(offer.count, 8u);
        std::array<int, kKernelCells * kKernelCells> times{};
        for (std::uint32_t c = 0; c < offer.count; ++c) {
          const auto& [i0, j0, i1, j1] = offer.cells[c];
          ASSERT_TRUE(i0 < i1 && j0 < j1 && i1 <= kKernelCells && j1 <= kKernelCells);
          for (int j = j0; j < j1; ++j)
            for (int i = i0; i < i1; ++i) ++times[size_t(j * kKernelCells + i)];
        }
        for (int j = 0; j < kKernelCells; ++j)
          for (int i = 0; i < kKernelCells; ++i) {
            const int t = times[size_t(j * kKernelCells + i)], x = kKernelCells + i, y = kKernelCells + j;
            EXPECT_LE(t, 1) << "disjoint";
            offered += t, real_but_not_offered += !t && cells.real(x, y);
            if (t && (i + j) % 3 == 0) {
              for (const int dy : {0, 1})
                for (const int dx : {0, 1})
                  EXPECT_EQ(brute_wide(cells, level, x + dx, y + dy), kFeatherCells);
            }
          }
      }
  EXPECT_GT(offered, 0);
  EXPECT_GT(real_but_not_offered, 0) << "negative control: real cells near a hole are not offered";
}

TEST(PatchSurface, AWholeBlockIsOfferedInOnePiece) {
  const Offer offer = make_offer(RandomCells(0, 1), 0, 0, 0);
  EXPECT_EQ(offer.count, 1u);
  EXPECT_EQ(offer.cells[0], (std::array<std::uint8_t, 4>{0, 0, kKernelCells, kKernelCells}));
}

}  // namespace
}  // namespace patchwork
