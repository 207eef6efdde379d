#include "db/patch_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "db/basis.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

// A grid of random codes with all its levels, and its surfaces evaluated one point at a time.
struct Terrain {
  Terrain(int w, int h, bool area, std::uint64_t seed, bool flat = false) : shape(w, h, area) {
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<int> rough(-1000, 1000);
    for (int k = 0; k < w * h; ++k) codes.push_back(flat ? 17 : rough(random) * (k % w > w / 2 ? 1 : 3));
    for (int l = 0; l < shape.levels(); ++l)
      levels.push_back(make_lattice(shape, l, 0, shape.lattice_rows(l),
                                    [&](int i, int j) { return codes[size_t(j * w + i)]; }));
  }
  template <int k>
  double surface(int level, double x, double y) const {
    const double u = std::ldexp(x, -level), v = std::ldexp(y, -level);
    const int i = int(std::floor(u)), j = int(std::floor(v));
    const CellWeights s = cell_weights<k>(u - i), t = cell_weights<k>(v - j);
    double row[4];
    for (int b = 0; b < 4; ++b) {
      const float* p = levels[size_t(level)].row(std::min(j - 1 + b, levels[size_t(level)].rows() + 1)) + i;
      row[b] = p[0] + (s.before * (p[-1] - p[0]) + s.far * (p[1] - p[0]) + s.beyond * (p[2] - p[0]));
    }
    return row[1] + (t.before * (row[0] - row[1]) + t.far * (row[2] - row[1]) + t.beyond * (row[3] - row[1]));
  }
  void measure(PatchErrors& e, int task_rows) const {
    for (int y = 0; y < shape.height(); y += task_rows)
      for (const Lattice& l : levels) e.measure(l, levels[0], {}, y, std::min(shape.height(), y + task_rows));
  }
  // The largest distance over a patch's domain, seen at points much denser than the samples.
  template <int k>
  double seen(int level, int bx, int by) const {
    const LatticeRect d = shape.domain(level, bx, by);
    double worst = 0;
    const int ni = int((d.i1 - d.i0) * 8), nj = int((d.j1 - d.j0) * 8);
    for (int b = 0; b <= nj; ++b)
      for (int a = 0; a <= ni; ++a) {
        const double x = d.i0 + (d.i1 - d.i0) * a / ni, y = d.j0 + (d.j1 - d.j0) * b / nj;
        worst = std::max(worst, std::abs(surface<k>(level, x, y) - surface<0>(0, x, y)));
      }
    return worst;
  }
  GridShape shape;
  std::vector<double> codes;
  std::vector<Lattice> levels;
  CellMasks whole;
};

TEST(PatchErrors, BoundEveryPointOfTheDomainAndAreExactForBilinearPatches) {
  const std::uint64_t seed = test_seed(1);
  for (const bool area : {false, true}) {
    const Terrain t(75, 61, area, seed);
    PatchErrors errors(t.shape, t.whole);
    t.measure(errors, 20);
    for (int l = 0; l < t.shape.levels(); ++l)
      for (int by = 0; by < t.shape.blocks_j(l); ++by)
        for (int bx = 0; bx < t.shape.blocks_i(l); ++bx) {
          const auto e = errors.of(l, bx, by);
          const double s0 = t.seen<0>(l, bx, by), s1 = t.seen<1>(l, bx, by), s2 = t.seen<2>(l, bx, by);
          EXPECT_LE(s0, e[0] + 1e-9) << l << " " << bx << " " << by;
          EXPECT_LE(s1, e[1]) << l << " " << bx << " " << by;
          EXPECT_LE(s2, e[2]) << l << " " << bx << " " << by;
          EXPECT_NEAR(s0, e[0], 1e-6) << l << " " << bx << " " << by;
          // Negative control: a bound of a third of the size is exceeded, even on white noise.
          EXPECT_GT(std::max(s1, s2), e[2] / 3) << l << " " << bx << " " << by;
        }
  }
}

TEST(PatchErrors, DoNotDependOnHowRowsAreShared) {
  const Terrain t(75, 61, true, test_seed(2));
  PatchErrors a(t.shape, t.whole), b(t.shape, t.whole);
  t.measure(a, 61), t.measure(b, 7);
  for (int l = 0; l < t.shape.levels(); ++l)
    for (int by = 0; by < t.shape.blocks_j(l); ++by)
      for (int bx = 0; bx < t.shape.blocks_i(l); ++bx) EXPECT_EQ(a.of(l, bx, by), b.of(l, bx, by));
}

TEST(PatchErrors, AreZeroOnFlatGround) {
  const Terrain t(75, 61, true, 0, true);
  PatchErrors errors(t.shape, t.whole);
  t.measure(errors, 61);
  for (int l = 0; l < t.shape.levels(); ++l) EXPECT_EQ(errors.of(l, 0, 0), (std::array<double, 3>{0, 0, 0}));
}

}  // namespace
}  // namespace patchwork
