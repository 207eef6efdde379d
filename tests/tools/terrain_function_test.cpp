#include "tools/terrain_function.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>
#include <vector>

#include "db/error.h"

namespace patchwork {
namespace {

std::mt19937_64 seeded() {
  const char* given = std::getenv("PATCHWORK_SEED");
  const std::uint64_t seed = given != nullptr ? std::strtoull(given, nullptr, 10) : std::random_device{}();
  std::cout << "PATCHWORK_SEED=" << seed << '\n';
  return std::mt19937_64(seed);
}

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

TerrainFunction terrain(std::uint32_t seed, double cliff = 12, double relief = 1200) {
  const Extent extent{500000, 5000000, 505120, 5005120};
  return TerrainFunction({.extent = extent, .relief = relief, .cliff = cliff, .seed = seed});
}

Point anywhere(std::mt19937_64& random, const TerrainFunction& t) {
  const Extent& e = t.parameters().extent;
  return {uniform(random, e.xmin, e.xmax), uniform(random, e.ymin, e.ymax)};
}

// A rotated lattice of 10 m inside the terrain.
Frame rotated_frame() { return Frame::from_trusted({501500, 8, 6, 5001500, -6, 8}); }

// The largest distance from the bilinear surface at random points of every cell: the reference.
double recheck(const TerrainFunction& t, const Frame& frame, int size, int per_cell,
               std::mt19937_64& random) {
  double worst = 0;
  const auto h = [&](double i, double j) {
    const Point p = frame.to_domain(i, j);
    return t.height(p.x, p.y);
  };
  for (int j = 0; j + 1 < size; ++j)
    for (int i = 0; i + 1 < size; ++i) {
      const double a = h(i, j), b = h(i + 1, j), c = h(i, j + 1), d = h(i + 1, j + 1);
      for (int k = 0; k < per_cell; ++k) {
        const double u = uniform(random, 0, 1), v = uniform(random, 0, 1);
        const double bilinear = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
        worst = std::max(worst, std::abs(h(i + u, j + v) - bilinear));
      }
    }
  return worst;
}

TEST(TerrainFunction, SameSeedGivesTheSameBits) {
  auto random = seeded();
  const TerrainFunction a = terrain(7), b = terrain(7);
  for (int k = 0; k < 10000; ++k) {
    const Point p = anywhere(random, a);
    ASSERT_EQ(a.height(p.x, p.y), b.height(p.x, p.y));
  }
}

// Golden values: a terrain made today is the terrain made by another compiler.
TEST(TerrainFunction, HasTheHeightsItAlwaysHad) {
  const TerrainFunction t = terrain(1);
  EXPECT_EQ(t.height(501000, 5001000), 1147.788728851139);
  EXPECT_EQ(t.height(504000, 5002000), 506.31699802772562);
}

TEST(TerrainFunction, ManyPointsAtOnceGiveTheBitsOfEachAlone) {
  auto random = seeded();
  const TerrainFunction t = terrain(3);
  std::vector<double> x, y, h(1000);
  for (int k = 0; k < 1000; ++k) {
    const Point p = anywhere(random, t);
    x.push_back(p.x), y.push_back(p.y);
  }
  t.heights(x, y, h);
  for (std::size_t k = 0; k < h.size(); ++k) ASSERT_EQ(h[k], t.height(x[k], y[k])) << k;
}

TEST(TerrainFunction, OtherSeedsGiveOtherTerrain) {
  auto random = seeded();
  const TerrainFunction a = terrain(1), b = terrain(2);
  int different = 0;
  for (int k = 0; k < 1000; ++k) {
    const Point p = anywhere(random, a);
    different += a.height(p.x, p.y) != b.height(p.x, p.y);
  }
  EXPECT_GT(different, 500);  // plains are alike
}

TEST(TerrainFunction, IsFiniteAndWithinItsReliefFarOutsideItsExtentToo) {
  auto random = seeded();
  const TerrainFunction t = terrain(4);
  const double highest = t.lake().level + 5 + t.parameters().relief + 2.5 * t.parameters().cliff;
  for (int k = 0; k < 10000; ++k) {
    const double reach = std::pow(10, uniform(random, 3, 300));
    const double h = t.height(uniform(random, -reach, reach), uniform(random, -reach, reach));
    ASSERT_GE(h, t.lake().level);
    ASSERT_LE(h, highest);
  }
}

TEST(TerrainFunction, LakeIsLevelForEverySeed) {
  auto random = seeded();
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const TerrainFunction t = terrain(seed);
    const Lake& lake = t.lake();
    for (int k = 0; k < 200; ++k) {
      const double r = uniform(random, 0, 0.499 * lake.radius), a = uniform(random, 0, 6.2831853);
      ASSERT_EQ(t.height(lake.centre.x + r * std::cos(a), lake.centre.y + r * std::sin(a)), lake.level)
          << seed;
    }
    // The negative control: well outside, the ground is above the water.
    EXPECT_GT(t.height(lake.centre.x + 1.5 * lake.radius, lake.centre.y), lake.level);
  }
}

TEST(TerrainFunction, CliffsAreNearlyVerticalAndNothingElseIs) {
  const auto steepest = [](const TerrainFunction& t) {
    double slope = 0;
    for (int row = 0; row < 20; ++row) {
      const double y = t.parameters().extent.ymin + 100 + 250 * row;
      double before = t.height(t.parameters().extent.xmin, y);
      for (int k = 1; k < 20480; ++k) {
        const double h = t.height(t.parameters().extent.xmin + 0.25 * k, y);
        slope = std::max(slope, std::abs(h - before) / 0.25);
        before = h;
      }
    }
    return slope;
  };
  const double hills = 300;
  EXPECT_GT(steepest(terrain(1, 12, hills)), 5);   // 79 degrees
  EXPECT_LT(steepest(terrain(1, 12, hills)), 40);  // finite
  EXPECT_LT(steepest(terrain(1, 0, hills)), 3);    // the negative control
}

TEST(TerrainFunction, PlainsAreFlat) {
  auto random = seeded();
  const TerrainFunction t = terrain(1, /*cliff=*/0);
  int flat = 0;
  for (int k = 0; k < 20000; ++k) {
    const Point p = anywhere(random, t);
    flat += t.height(p.x, p.y) == t.lake().level + 5;
  }
  EXPECT_GT(flat, 200);
  EXPECT_LT(flat, 16000);
}

TEST(InterpolationError, BoundsADenseRecheckAndHalfOfItDoesNot) {
  auto random = seeded();
  for (const double cliff : {0., 12.})
    for (std::uint32_t seed = 1; seed <= 4; ++seed) {
      const TerrainFunction t = terrain(seed, cliff);
      const double bound = interpolation_error(t, rotated_frame(), 129, 129);
      const double found = recheck(t, rotated_frame(), 129, 40, random);
      EXPECT_LE(found, bound) << "seed " << seed << " cliff " << cliff;
      EXPECT_GT(found, bound / 2) << "seed " << seed << " cliff " << cliff;
    }
}

TEST(InterpolationError, IsZeroOnTheLake) {
  const TerrainFunction t = terrain(1);
  const Lake& lake = t.lake();
  const Frame frame = Frame::from_trusted({lake.centre.x - 100, 10, 0, lake.centre.y - 100, 0, 10});
  EXPECT_EQ(interpolation_error(t, frame, 21, 21), 0);
}

TEST(InterpolationError, DoesNotDependOnTheNumberOfThreads) {
  const TerrainFunction t = terrain(5);
  const double all = interpolation_error(t, rotated_frame(), 200, 150);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(interpolation_error(t, rotated_frame(), 200, 150), all);
}

TEST(TerrainFunction, RefusesExtentsAndHeightsThatMeanNothing) {
  EXPECT_THROW(TerrainFunction({.extent = {0, 0, 0, 1}}), Error);
  EXPECT_THROW(TerrainFunction({.extent = {0, 0, INFINITY, 1}}), Error);
  EXPECT_THROW(TerrainFunction({.extent = {0, 0, 1, NAN}}), Error);
  EXPECT_THROW(TerrainFunction({.relief = -1}), Error);
  EXPECT_THROW(TerrainFunction({.cliff = NAN}), Error);
}

}  // namespace
}  // namespace patchwork
