// The blocks of a grid against the sentences of the model that define them.
#include "db/grid_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "tests/seed.h"

namespace patchwork {
namespace {

bool inside(const LatticeRect& a, const LatticeRect& b) {
  return a.i0 >= b.i0 && a.j0 >= b.j0 && a.i1 <= b.i1 && a.j1 <= b.j1;
}
bool equal(const LatticeRect& a, const LatticeRect& b) { return inside(a, b) && inside(b, a); }

std::vector<GridShape> shapes() {
  std::vector<GridShape> all;
  for (const bool is_area : {false, true})
    for (const auto& [w, h] : std::vector<std::pair<int, int>>{{2, 2},
                                                               {2, 3},
                                                               {3, 200},
                                                               {28, 29},
                                                               {30, 31},
                                                               {33, 57},
                                                               {58, 59},
                                                               {113, 112},
                                                               {225, 449},
                                                               {1000, 61}})
      all.emplace_back(w, h, is_area);
  return all;
}

template <class Visit>
void each_block(const GridShape& s, int level, Visit visit) {
  for (int by = 0; by < s.blocks_j(level); ++by)
    for (int bx = 0; bx < s.blocks_i(level); ++bx) visit(bx, by);
}

// Corners where large numbers cancel: R-tree boxes and regions are compared with what is computed of them.
TEST(Frame, BoundsHoldTheExactCorners) {
  std::mt19937_64 random(test_seed(5));
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  int cancelled = 0;
  for (int n = 0; n < 20000; ++n) {
    const double angle = uniform(0, 7), step = uniform(1, 40), i = std::floor(uniform(0, 250000)),
                 j = std::floor(uniform(0, 250000)), c = step * std::cos(angle), s = step * std::sin(angle);
    // So that the corner (i, j) lies near the origin.
    const Frame f = Frame::from_trusted({-(c * i + s * j) + uniform(0, 0.01), c, s, -(s * i - c * j), s, -c});
    const auto& m = f.numbers();
    const long double x = m[0] + ((long double)m[1] * i + (long double)m[2] * j),
                      y = m[3] + ((long double)m[4] * i + (long double)m[5] * j);
    const Extent e = f.bounds({i, j, i + 28, j + 28});
    ASSERT_TRUE(e.xmin <= x && x <= e.xmax && e.ymin <= y && y <= e.ymax) << n;
    const Point p = f.to_domain(i, j);
    cancelled += std::abs(double(x) - p.x) > 4e-16 * std::abs(p.x);
  }
  EXPECT_GT(cancelled, 5000) << "negative control: by the corner's own size they would not be held";
}

TEST(GridShape, TheCoreIsTheFootprintLessOneFeatherThatIsAtMostAQuarterOfASide) {
  for (const GridShape& s : shapes()) {
    const LatticeRect f = s.footprint(), c = s.core();
    const double pad = s.pixel_is_area() ? 0.5 : 0;
    EXPECT_TRUE(equal(f, {-pad, -pad, s.width() - 1 + pad, s.height() - 1 + pad}));
    EXPECT_EQ(c.i0 - f.i0, std::min<double>(kFeatherCells, (f.i1 - f.i0) / 4));
    EXPECT_EQ(f.j1 - c.j1, std::min<double>(kFeatherCells, (f.j1 - f.j0) / 4));
    EXPECT_FALSE(c.empty());
  }
}

TEST(GridShape, TheKernelsOfEveryLevelTileTheSameCore) {
  for (const GridShape& s : shapes())
    for (int l = 0; l < s.levels(); ++l) {
      double sum = 0;
      each_block(s, l, [&](int bx, int by) {
        const LatticeRect k = s.kernel(l, bx, by);
        EXPECT_FALSE(k.empty()) << "a block without a kernel makes no patch";
        EXPECT_TRUE(inside(k, s.core()));
        if (bx > 0) {
          EXPECT_EQ(k.i0, s.kernel(l, bx - 1, by).i1);
        }
        if (by > 0) {
          EXPECT_EQ(k.j0, s.kernel(l, bx, by - 1).j1);
        }
        sum += k.area();
      });
      EXPECT_EQ(sum, s.core().area()) << s.width() << " x " << s.height() << " level " << l;
      // Negative control: a feather of so many cells of each level leaves parents too small.
      const double rim = std::ldexp(kFeatherCells, l);
      const LatticeRect f = s.footprint(), naive{f.i0 + rim, f.j0 + rim, f.i1 - rim, f.j1 - rim};
      if (l > 0) {
        EXPECT_FALSE(inside(s.core(), naive));
      }
    }
}

TEST(GridShape, AKernelIsTheUnionOfItsFourChildren) {
  for (const GridShape& s : shapes())
    for (int l = 1; l < s.levels(); ++l)
      each_block(s, l, [&](int bx, int by) {
        double sum = 0;
        for (int y = 2 * by; y < std::min(2 * by + 2, s.blocks_j(l - 1)); ++y)
          for (int x = 2 * bx; x < std::min(2 * bx + 2, s.blocks_i(l - 1)); ++x) {
            EXPECT_TRUE(inside(s.kernel(l - 1, x, y), s.kernel(l, bx, by)));
            sum += s.kernel(l - 1, x, y).area();
          }
        EXPECT_EQ(sum, s.kernel(l, bx, by).area());
      });
}

TEST(GridShape, DomainsOutgrowTheirBlocksByTwoCellsOfTheirLevelAndEndAtTheFootprint) {
  for (const GridShape& s : shapes())
    for (int l = 0; l < s.levels(); ++l)
      each_block(s, l, [&](int bx, int by) {
        const LatticeRect d = s.domain(l, bx, by), f = s.footprint();
        const double side = std::ldexp(28, l), rim = std::ldexp(2, l);
        EXPECT_EQ(d.i0, std::max(f.i0, bx * side - rim));
        if (by + 1 < s.blocks_j(l)) {
          EXPECT_EQ(d.j1, std::min(f.j1, (by + 1) * side + rim));
        }
        EXPECT_TRUE(inside(s.kernel(l, bx, by), d));
        if (bx + 1 == s.blocks_i(l)) {
          EXPECT_EQ(d.i1, f.i1) << "what the last block leaves over lies in its extension";
        }
        if (by == 0) {
          EXPECT_EQ(d.j0, f.j0);
        }
      });
}

TEST(GridShape, LatticesReachTheLastSampleAndNoFurtherThanNeeded) {
  for (const GridShape& s : shapes())
    for (int l = 0; l < s.levels(); ++l) {
      const int step = 1 << l, reach = (s.lattice_cols(l) - 1) * step;
      EXPECT_GE(reach, s.width() - 1);
      EXPECT_LT(reach - step, s.width() - 1);
      EXPECT_EQ(s.chunks_j(l), int(std::ceil(s.lattice_rows(l) / 112.0)));
    }
}

TEST(GridShape, IndicesNumberAllBlocksOfAllLevelsAndThePyramidEndsWithOneBlock) {
  for (const GridShape& s : shapes()) {
    std::set<std::size_t> seen;
    for (int l = 0; l < s.levels(); ++l)
      each_block(s, l, [&](int bx, int by) {
        const std::size_t k = s.index(l, bx, by);
        EXPECT_TRUE(seen.insert(k).second);
        const GridShape::Block b = s.block(k);
        EXPECT_EQ(b.level, l);
        EXPECT_EQ(b.bx, bx);
        EXPECT_EQ(b.by, by);
      });
    EXPECT_EQ(seen.size(), s.blocks());
    EXPECT_EQ(*seen.rbegin() + 1, s.blocks());
    EXPECT_EQ(s.blocks_i(s.levels() - 1) * s.blocks_j(s.levels() - 1), 1);
    if (s.levels() > 1) {
      EXPECT_GT(s.blocks_i(s.levels() - 2) * s.blocks_j(s.levels() - 2), 1);
    }
  }
}

}  // namespace
}  // namespace patchwork
