// SourceExact, PartitionOfUnity, RimWeights, FarOrigin, RatioOfScales, SplineStencil (hard cases): what the
// blend must give back without any error of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "blend/kernels.h"
#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

// Rotated by the angles of Pythagorean triples (3 4 5, 5 12 13, 20 21 29): positions of vertices are exact.
std::vector<GridFile> exact_frames() {
  return {{.width = 80, .height = 60, .geotransform = {0, 20, 0, 1200, 0, -20}},
          {.width = 90, .height = 70, .geotransform = {300, 4, 3, 500, 3, -4}},
          {.width = 40, .height = 60, .geotransform = {600, -5, 12, 300, 12, 5}, .pixel_is_area = false},
          {.width = 70, .height = 50, .geotransform = {700, 10, 10.5, 900, 10.5, -10}}};
}

// All patches of all grids in the order in which they speak, redundant ones too.
std::vector<PatchId> every_patch(const Database& db) {
  struct Entry {
    double bottom;
    const Grid* grid;
    std::size_t index;
  };
  std::vector<Entry> all;
  each_patch(db, [&](const Grid& g, std::size_t k, const GridShape::Block&) {
    all.push_back({g.patches[k].bottom, &g, k});
  });
  std::stable_sort(all.begin(), all.end(),
                   [](const Entry& a, const Entry& b) { return a.bottom < b.bottom; });
  std::vector<PatchId> ids;
  for (const Entry& e : all) ids.push_back(e.grid->patch_id(e.index));
  return ids;
}

TEST(SourceExact, AVertexOfTheMostAccurateGridInsideItsKernelGivesTheStoredValue) {
  std::mt19937_64 random(test_seed(1));
  std::uniform_int_distribution<int> sixty_fourths(-100000, 100000);
  std::vector<double> noise(80 * 80);
  for (double& v : noise) v = sixty_fourths(random) / 64.0;
  GridFile fine{.width = 80, .height = 80, .geotransform = {200, 4, 0, 700, 0, -4}, .accuracy = 0.5};
  fine.at = [&](int i, int j) { return noise[size_t(j * 80 + i)]; };
  GridFile base = exact_frames()[0];
  base.accuracy = 5, base.at = [](int, int) { return 3.0; };
  const Land scene({base, fine});
  const Grid& g = scene.db().grids()[1];
  Points points;
  std::vector<double> stored;
  const LatticeRect core = g.info.shape.core();
  for (int j = int(std::ceil(core.j0)); j <= core.j1; ++j)
    for (int i = int(std::ceil(core.i0)); i <= core.i1; ++i)
      points.add(g.info.frame.to_domain(i, j)), stored.push_back(fine.at(i, j));
  ASSERT_GT(points.size(), 3000u);
  for (int k = 0; k <= 2; ++k) {
    EXPECT_EQ(evaluate(scene.db(), 0, points, {.smoothness = k}).height, stored);
    const BlendOptions weighted{.smoothness = k, .composition = Composition::weighted};
    EXPECT_NE(evaluate(scene.db(), 0, points, weighted).height, stored) << "negative control: a mean";
  }
  report_law("SourceExact", "vertices give the stored value to the last bit, k = 0, 1, 2", 3 * points.size());
}

TEST(PartitionOfUnity, ConstantTerrainIsReproducedToTheLastBit) {
  constexpr double height = 1234.5;
  std::vector<GridFile> grids = surveys();
  for (GridFile& g : grids) g.at = [](int, int) { return height; }, g.accuracy = 0.1;
  const Land scene(grids);
  std::mt19937_64 random(test_seed(2));
  const Points points = random_points(scene.db().extent(), 10000, random);
  const std::vector<PatchId> all = every_patch(scene.db());
  for (const BlendOptions& options : all_blends()) {
    const Answers a = evaluate(scene.db(), all, points, options);
    std::size_t answered = 0;
    for (std::size_t k = 0; k < points.size(); ++k)
      if (a.source[k] != 0) {
        ++answered;
        ASSERT_EQ(a.height[k], height) << name_of(options);
      }
    EXPECT_GT(answered, points.size() / 2);
  }
  report_law("PartitionOfUnity", "constant terrain to the last bit, every patch there is", 6 * points.size());
}

TEST(PartitionOfUnity, ThePlainSumOfTheWeightsIsNotOne) {
  const GridShape shape(80, 60, true);
  const LatticeRect kernel = shape.kernel(0, 0, 0), domain = shape.domain(0, 0, 0);
  const double u[] = {0.5, 5, 20}, v[] = {20, 20, 20};
  double ramp[3], wendland[3];
  for (int k = 0; k <= 2; ++k) {
    kernels::ramp_weights(k, kernel, domain, domain, u, v, 3, ramp);
    kernels::wendland_weights(k, domain, u, v, 3, wendland);
    EXPECT_TRUE(ramp[0] < 1 && ramp[1] < 1 && ramp[2] == 1);
    EXPECT_TRUE(wendland[0] < 0.9 && wendland[1] < 0.9 && wendland[0] > 0);
  }
}

TEST(PartitionOfUnity, ASharedPlaneIsReproduced) {
  const auto plane = [](double x, double y) { return 100 + 0.25 * x - 0.125 * y; };
  std::vector<GridFile> grids = exact_frames();
  for (GridFile& g : grids) g = of_terrain(g, plane), g.accuracy = 0.5;
  const Land scene(grids);
  std::mt19937_64 random(test_seed(3));
  const Points points = random_points(scene.db().extent(), 20000, random);
  const std::vector<PatchId> all = every_patch(scene.db());
  double worst = 0;
  for (const BlendOptions& options : all_blends()) {
    const Answers a = evaluate(scene.db(), all, points, options);
    EXPECT_GT(a.source.size() - std::size_t(std::count(a.source.begin(), a.source.end(), 0)),
              points.size() / 4);
    for (std::size_t k = 0; k < points.size(); ++k)
      if (a.source[k] != 0) {
        ASSERT_NEAR(a.height[k], plane(points.x[k], points.y[k]), 1e-12 * 500) << name_of(options);
        worst = std::max(worst, std::abs(a.height[k] - plane(points.x[k], points.y[k])));
      }
  }
  report_case("PartitionOfUnity", "a shared plane, 500 m of relief", 6 * points.size(), worst, 5e-10, "m");
}

class RimWeights : public ::testing::TestWithParam<bool> {};  // pixel is area

// Two grids side by side whose footprints share only the feathers.
TEST_P(RimWeights, PointsJustInsideTheRimOfAllDataAnswerWithWhatTheGridsSay) {
  const bool area = GetParam();
  GridFile west{.width = 40, .height = 40, .geotransform = {0, 10, 0, 400, 0, -10}, .pixel_is_area = area};
  GridFile east = west;
  east.geotransform[0] = 360;
  west.at = [](int, int) { return 10.0; }, east.at = [](int, int) { return 20.0; };
  const Land scene({west, east});
  const Extent e = scene.db().extent();
  const double rim = area ? 0 : 5;
  ASSERT_NEAR(e.xmin, rim, 1e-6);
  Points points;
  const double up = std::numeric_limits<double>::infinity(), first = rim, last = 400 - rim;
  for (const double inside : {0.0, 1e-14, 1e-11, 1e-8, 1e-5}) {
    const double low = inside == 0 ? std::nextafter(first, up) : first + inside;
    const double high = inside == 0 ? std::nextafter(last, 0) : last - inside;
    for (const double t : {low, 17.3, 200.0, 383.1, high}) {
      points.add(low, t), points.add(t, low), points.add(t, high), points.add(360 + high, t);
      points.add(360 + low, t), points.add(high, t), points.add(360 + t, low), points.add(360 + t, high);
    }
  }
  points.add(first, first), points.add(first, last), points.add(360 + last, first), points.add(first, 200);
  for (const double error : {0.0, 100.0})
    for (const BlendOptions& options : all_blends()) {
      const Answers a = evaluate(scene.db(), error, points, options);
      for (std::size_t k = 0; k < points.size(); ++k) {
        ASSERT_TRUE(std::isfinite(a.height[k]) && std::isfinite(a.bound[k]))
            << name_of(options) << " at " << std::hexfloat << points.x[k] << " " << points.y[k];
        const bool in_west = points.x[k] <= last, in_east = points.x[k] >= 360 + first;
        ASSERT_GE(a.height[k], in_west ? 10 : 20);
        ASSERT_LE(a.height[k], in_east ? 20 : 10);
        ASSERT_GT(a.source[k], 0);
      }
    }
  report_law("RimWeights", "finite and between the grids, 0 to 1e-5 m inside the rim", 12 * points.size());
}

// The naive form: a mean of heights with the plain ramps as weights, in float32.
TEST(RimWeights, PlainWeightsInFloatUnderflowToNothing) {
  const GridShape shape(40, 40, true);
  const LatticeRect kernel = shape.kernel(0, 0, 0), domain = shape.domain(0, 0, 0);
  const double at[] = {domain.i0, domain.i0 + 1e-14, domain.i0 + 1e-11, domain.i0 + 1e-8};
  double ramp[4];
  kernels::ramp_weights(2, kernel, domain, domain, at, at, 4, ramp);
  for (const double w : ramp) {
    const float weight = float(w), mean = weight * 10.0f / weight;
    EXPECT_TRUE(std::isnan(mean)) << "negative control: 0 / 0 at weight " << w;
  }
}

TEST_P(RimWeights, PointsJustOutsideHaveNoData) {
  GridFile one{
      .width = 40, .height = 40, .geotransform = {0, 10, 0, 400, 0, -10}, .pixel_is_area = GetParam()};
  const Land scene({one});
  const double first = GetParam() ? 0 : 5, last = 400 - first;
  Points points;
  points.add(std::nextafter(last, 1e9), 200), points.add(200, std::nextafter(last, 1e9));
  points.add(first - 1e-12, 200), points.add(200, first - 1e-12);
  for (const BlendOptions& options : all_blends())
    for (const std::int32_t source : evaluate(scene.db(), 0, points, options).source) EXPECT_EQ(source, 0);
}

INSTANTIATE_TEST_SUITE_P(Registration, RimWeights, ::testing::Bool(),
                         [](const auto& p) { return std::string(p.param ? "Area" : "Point"); });

TEST(FarOrigin, TheSameGridsFarAwayAndInDegreesGiveTheSameHeights) {
  // Metres. Frames far away are rounded to 1e-9 m, thrice, on slopes of about 1; 1e-6 of a cell is asked for.
  constexpr double kTolerance = 1e-7;
  struct Place {
    const char* name;
    double scale;  // units of the domain a metre; a power of two: it rounds nothing
    Point offset;
  };
  const Place places[] = {
      {"the same grids moved by (500000, 5000000) m", 1, {500000, 5000000}},
      {"the same grids moved by (10000000, -10000000) m", 1, {1e7, -1e7}},
      {"the same grids in steps of 1e-5 degrees, moved by (11, 47) degrees", 0x1p-18, {11, 47}}};
  std::mt19937_64 random(test_seed(4));
  for (const Place& place : places) {
    std::vector<GridFile> near = surveys();
    for (GridFile& g : near)
      for (double& v : g.geotransform) v *= place.scale;
    std::vector<GridFile> far = near;
    for (GridFile& g : far) g.geotransform[0] += place.offset.x, g.geotransform[3] += place.offset.y;
    const Land here(near), there(far);
    double worst = 0, rounded = 0;
    Points a = random_points(here.db().extent(), 3000, random), b;
    for (std::size_t k = 0; k < a.size(); ++k) {
      a.x[k] = std::round(a.x[k] / place.scale * 64) / 64 * place.scale;
      a.y[k] = std::round(a.y[k] / place.scale * 64) / 64 * place.scale;
      b.add(a.x[k] + place.offset.x, a.y[k] + place.offset.y);
      rounded = std::max(rounded, std::abs(double(float(b.x[k])) - b.x[k]) / place.scale);
    }
    for (const double error : {0.0, 3.0})
      for (const BlendOptions& options : all_blends()) {
        const Answers p = evaluate(here.db(), error, a, options), q = evaluate(there.db(), error, b, options);
        for (std::size_t k = 0; k < a.size(); ++k) {
          ASSERT_EQ(p.source[k] == 0, q.source[k] == 0);
          if (p.source[k] == 0) continue;
          ASSERT_NEAR(p.height[k], q.height[k], kTolerance) << name_of(options) << ", " << place.name;
          ASSERT_NEAR(p.bound[k], q.bound[k], 10 * kTolerance) << name_of(options) << ", " << place.name;
          worst = std::max(worst, std::abs(p.height[k] - q.height[k]));
        }
      }
    report_case("FarOrigin", place.name, 12 * a.size(), worst, kTolerance, "m");
    EXPECT_GT(rounded, 1e-3) << "negative control: float32 coordinates would not do";
  }
}

TEST(RatioOfScales, ACentimetreGridOnAKilometreGridIsImportedAndReadInBoundedTime) {
  const auto start = std::chrono::steady_clock::now();
  GridFile globe{.width = 60, .height = 60, .geotransform = {0, 1000, 0, 60000, 0, -1000}, .accuracy = 50};
  globe.at = [](int i, int j) { return 1000.0 + 8 * ((3 * i + 5 * j) % 7); };
  GridFile drone{.width = 300, .height = 300, .geotransform = rotated(30210, 30570, 31, 0.01, 0.01)};
  drone.accuracy = 0.02, drone.at = [](int i, int j) { return 1020 + 0.125 * ((i / 8 + j / 8) % 2); };
  const Land scene({globe, drone});
  const Frame& frame = scene.db().grids()[1].info.frame;
  Points inside, outside;
  std::vector<double> stored;
  for (int j = 12; j < 288; j += 3)
    for (int i = 12; i < 288; i += 3) inside.add(frame.to_domain(i, j)), stored.push_back(drone.at(i, j));
  for (int k = 0; k < 1000; ++k) outside.add(500 + 59.0 * k, 500 + 57.0 * k);
  double worst = 0;
  for (const BlendOptions& options : all_blends()) {
    const Answers fine = evaluate(scene.db(), 0, inside, options);
    const Answers coarse = evaluate(scene.db(), 0, outside, options);
    for (std::size_t k = 0; k < inside.size(); ++k) {
      if (options.composition == Composition::priority) {
        ASSERT_NEAR(fine.height[k], stored[k], 1e-6);
        worst = std::max(worst, std::abs(fine.height[k] - stored[k]));
      }
      ASSERT_LE(std::abs(fine.height[k] - stored[k]), fine.bound[k]);
    }
    for (const std::int32_t source : coarse.source) ASSERT_EQ(source, 1);
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_LT(seconds.count(), 20) << "recursion per cell would take minutes";
  report_case("RatioOfScales", "1 cm cells on 1 km cells: stored values", 6 * inside.size(), worst, 1e-6,
              "m");
  // The naive form splits every cell of the coarse grid that the fine one touches down to the fine step.
  const double cells = std::pow(1000 / 0.01, 2);
  EXPECT_GT(cells, 1e5 * double(scene.db().tree().size())) << "negative control: boxes, not cells, are kept";
}

class SplineStencil : public ::testing::Test {
 protected:
  static GridFile spikes() {
    GridFile g{.width = 131, .height = 100, .geotransform = {0, 8, 0, 800, 0, -8}};
    g.at = [](int i, int j) { return (i * 37 + j * 101) % 23 == 0 ? 5000.0 : double((i * 5 + j * 3) % 11); };
    return g;
  }
};

TEST_F(SplineStencil, NeighbouringPatchesOfALevelAgreeInTheirOverlap) {
  const Land scene({spikes()});
  const Grid& g = scene.db().grids()[0];
  const GridShape& shape = g.info.shape;
  constexpr std::pair<int, int> kWays[] = {{1, 0}, {0, 1}, {1, 1}, {-1, 1}};
  std::array<std::size_t, 4> overlaps{};
  std::size_t tries = 0;
  for (int level = 0; level < shape.levels(); ++level)
    for (int by = 0; by < shape.blocks_j(level); ++by)
      for (int bx = 0; bx < shape.blocks_i(level); ++bx)
        for (std::size_t way = 0; way < 4; ++way) {
          const int x = bx + kWays[way].first, y = by + kWays[way].second;
          if (x < 0 || !shape.has(level, x, y)) continue;
          const LatticeRect a = shape.domain(level, bx, by), b = shape.domain(level, x, y);
          const double i0 = std::max(a.i0, b.i0), i1 = std::min(a.i1, b.i1);
          const double j0 = std::max(a.j0, b.j0), j1 = std::min(a.j1, b.j1);
          Points points;
          for (int j = 0; j <= 32; j += 2)  // coordinates in dyadic parts of a cell: no rounding on the way
            for (int i = 0; i <= 32; ++i)
              points.add(g.info.frame.to_domain(i0 + (i1 - i0) * i / 32, j0 + (j1 - j0) * j / 32));
          const PatchId one = g.patch_id(shape.index(level, bx, by)),
                        other = g.patch_id(shape.index(level, x, y));
          for (int k = 0; k <= 2; ++k) {
            const BlendOptions options{.smoothness = k};
            const Answers p = evaluate(scene.db(), std::span(&one, 1), points, options);
            const Answers q = evaluate(scene.db(), std::span(&other, 1), points, options);
            ASSERT_EQ(p.height, q.height) << "level " << level << " k=" << k << " way " << way;
            tries += points.size();
          }
          ++overlaps[way];
        }
  for (const std::size_t n : overlaps) EXPECT_GT(n, 10u);
  report_law("SplineStencil", "neighbours of a level agree to the last bit, spikes of 5 km", tries);
}

// Beyond two samples a lattice continues them linearly: no order of smoothness bends what lies between.
TEST_F(SplineStencil, BetweenTwoSamplesEveryOrderIsLinear) {
  for (const char* text :
       {"0 100 / 300 -50", "0 100 / 300 -50 / 7 7 / 5000 1 / 2 3", "0 300 7 5000 2 / 100 -50 7 1 3"})
    for (const bool area : {false, true}) {
      const GridFile file = heights(text, {.geotransform = {0, 8, 0, 80, 0, -8}, .pixel_is_area = area});
      const Land scene({file});
      const Frame& frame = scene.db().grids()[0].info.frame;
      const bool two_along_i = file.width == 2;
      const int others = two_along_i ? file.height : file.width;
      Points points;
      for (int n = 0; n <= 8 * (others - 1); ++n)
        for (int m = 0; m <= 8; ++m)
          points.add(two_along_i ? frame.to_domain(m / 8.0, n / 8.0) : frame.to_domain(n / 8.0, m / 8.0));
      for (const BlendOptions& options : all_blends()) {
        const Answers a = evaluate(scene.db(), 0, points, options);
        for (std::size_t n = 0; n < points.size(); n += 9)
          for (std::size_t m = 0; m <= 8; ++m) {
            const double t = double(m) / 8;
            ASSERT_NEAR(a.height[n + m], (1 - t) * a.height[n] + t * a.height[n + 8], 1e-9)
                << name_of(options) << ": " << text;
          }
      }
    }
  // A third sample bends it: -100, 0, 100, 0 with weights -1/16, 9/16, 9/16, -1/16.
  const Land three({heights("0 100 0 / 0 100 0", {.geotransform = {0, 8, 0, 80, 0, -8}})});
  Points middle;
  middle.add(three.db().grids()[0].info.frame.to_domain(0.5, 0.5));
  for (int k = 0; k <= 2; ++k)
    EXPECT_NEAR(evaluate(three.db(), 0, middle, {.smoothness = k}).height[0], k == 0 ? 50 : 62.5, 1e-9)
        << "negative control, k=" << k;
}

// The naive form: a natural spline of each patch's own samples. Second derivatives of n samples a unit apart.
std::vector<double> natural_spline(const std::vector<double>& h) {
  const std::size_t n = h.size();
  std::vector<double> m(n, 0), diagonal(n, 4), right(n, 0);
  for (std::size_t k = 1; k + 1 < n; ++k) right[k] = 6 * (h[k - 1] - 2 * h[k] + h[k + 1]);
  for (std::size_t k = 2; k + 1 < n; ++k)
    diagonal[k] -= 1 / diagonal[k - 1], right[k] -= right[k - 1] / diagonal[k - 1];
  for (std::size_t k = n - 2; k > 0; --k) m[k] = (right[k] - m[k + 1]) / diagonal[k];
  return m;
}

TEST_F(SplineStencil, NaturalEndsWouldTearNeighboursApart) {
  const GridFile file = spikes();
  const auto row = [&](int first, int n) {
    std::vector<double> h;
    for (int i = first; i < first + n; ++i) h.push_back(file.at(i, 40));
    return h;
  };
  // Two patches of 33 samples that share five of them, in the middle of the second shared cell.
  const std::vector<double> a = row(0, 33), b = row(28, 33), ma = natural_spline(a), mb = natural_spline(b);
  const auto middle = [](const std::vector<double>& h, const std::vector<double>& m, std::size_t k) {
    return (h[k] + h[k + 1]) / 2 - (m[k] + m[k + 1]) / 16;
  };
  EXPECT_GT(std::abs(middle(a, ma, 29) - middle(b, mb, 1)), 0.1) << "negative control: decimetres apart";
}

TEST_F(SplineStencil, SpikesStayWithinTheBoundAndFinite) {
  const GridFile file = spikes();
  const Land scene({file});
  const Grid& g = scene.db().grids()[0];
  std::mt19937_64 random(test_seed(5));
  const Points points = random_points(scene.db().extent(), 20000, random);
  double worst = 0;
  for (const BlendOptions& options : all_blends()) {
    const Answers a = evaluate(scene.db(), 0, points, options);
    for (std::size_t k = 0; k < points.size(); ++k) {
      ASSERT_TRUE(std::isfinite(a.height[k]));
      const Point q = g.info.frame.to_lattice(points.x[k], points.y[k]);
      const int i = std::clamp(int(q.x), 0, file.width - 2), j = std::clamp(int(q.y), 0, file.height - 2);
      const double s = q.x - i, t = q.y - j;
      const double h = (1 - t) * ((1 - s) * file.at(i, j) + s * file.at(i + 1, j)) +
                       t * ((1 - s) * file.at(i, j + 1) + s * file.at(i + 1, j + 1));
      ASSERT_LE(std::abs(a.height[k] - h), a.bound[k]) << name_of(options);
      worst = std::max(worst, std::abs(a.height[k] - h) / a.bound[k]);
    }
  }
  report_case("SplineStencil", "spikes of 5 km keep to the bound", 6 * points.size(), worst, 1,
              "of the bound");
}

}  // namespace
}  // namespace patchwork
