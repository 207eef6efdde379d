// The vertices of every level: taken from the samples, continued linearly where the samples end.
#include "db/lattice.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/seed.h"

namespace patchwork {
namespace {

struct Codes {
  Codes(int w, int h, std::uint64_t seed) : width(w) {
    std::mt19937_64 random(seed);
    for (int k = 0; k < w * h; ++k) values.push_back(int(random() % 2001) - 1000);
  }
  double operator()(int i, int j) const { return values[size_t(j * width + i)]; }
  int width;
  std::vector<int> values;
};

TEST(Lattice, HoldsEverySecondVertexOfTheLevelBelow) {
  const Codes codes(75, 61, test_seed(1));
  const GridShape shape(75, 61, false);
  int beyond = 0;
  for (int l = 0; l < shape.levels(); ++l) {
    const Lattice lattice = make_lattice(shape, l, 0, shape.lattice_rows(l), codes);
    for (int r = 0; r < lattice.rows(); ++r)
      for (int c = 0; c < lattice.cols(); ++c) {
        if ((c << l) > 74 || (r << l) > 60)
          ++beyond;
        else
          EXPECT_EQ(lattice.row(r)[c], codes(c << l, r << l));
      }
  }
  EXPECT_GT(beyond, 0) << "some level ends beyond the last sample";
}

TEST(Lattice, ContinuesAPlaneExactlyBeyondItsSamplesAndInTheRing) {
  const auto plane = [](int i, int j) { return 3.0 * i - 7.0 * j + 11; };
  int beyond = 0, clamped_differs = 0;
  for (const auto& [w, h] :
       std::vector<std::pair<int, int>>{{2, 2}, {3, 30}, {34, 33}, {60, 75}, {200, 131}}) {
    const GridShape shape(w, h, true);
    for (int l = 0; l < shape.levels(); ++l) {
      const Lattice lattice = make_lattice(shape, l, 0, shape.lattice_rows(l), plane);
      for (int r = -2; r < lattice.rows() + 2; ++r)
        for (int c = -2; c < lattice.cols() + 2; ++c) {
          ASSERT_EQ(lattice.row(r)[c], plane(c * (1 << l), r * (1 << l))) << l << ": " << c << ", " << r;
          beyond += c * (1 << l) > w - 1;
          clamped_differs += plane(std::clamp(c * (1 << l), 0, w - 1), 0) != plane(c * (1 << l), 0);
        }
    }
  }
  EXPECT_GT(beyond, 0);
  EXPECT_GT(clamped_differs, 0) << "negative control: repeating the last sample is no plane";
}

TEST(Lattice, ARunOfRowsEqualsTheSameRowsOfTheWhole) {
  const Codes codes(75, 61, test_seed(2));
  const GridShape shape(75, 61, true);
  for (int l = 0; l < shape.levels(); ++l) {
    const int rows = shape.lattice_rows(l);
    const Lattice whole = make_lattice(shape, l, 0, rows, codes);
    for (int first = 0; first + 2 <= rows; first += 3) {
      const int count = std::min(5, rows - first);
      const Lattice run = make_lattice(shape, l, first, count, codes);
      const int from = first == 0 ? -2 : first, to = first + count == rows ? rows + 2 : first + count;
      for (int r = from; r < to; ++r)
        for (int c = -2; c < run.cols() + 2; ++c) EXPECT_EQ(run.row(r)[c], whole.row(r)[c]);
    }
  }
}

TEST(LatticeAxis, StoresTheVertexBeyondOnlyWhereTheLastSampleIsNoVertex) {
  for (int level = 0; level < 6; ++level)
    for (int n = 2; n < 140; ++n) {
      const LatticeAxis axis(n, level);
      EXPECT_EQ(axis.beyond(), (n - 1) % (1 << level) != 0);
      EXPECT_LT(axis.before, axis.last);
    }
}

}  // namespace
}  // namespace patchwork
