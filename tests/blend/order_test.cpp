// SummationOrder (hard cases): the bits of an answer depend on the data and the point alone.
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <numeric>

#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

class SummationOrder : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::vector<GridFile> grids = surveys();
    grids[1].at = [whole = grids[1].at](int i, int j) {
      return i > 30 && i < 50 && j > 20 && j < 40 ? kHole : whole(i, j);
    };
    scene_ = std::make_unique<Land>(grids);
  }
  static void TearDownTestSuite() { scene_.reset(); }
  static const Database& db() { return scene_->db(); }
  static std::unique_ptr<Land> scene_;
};
std::unique_ptr<Land> SummationOrder::scene_;

TEST_F(SummationOrder, SameBitsForAnyNumberOfThreads) {
  std::mt19937_64 random(test_seed(1));
  const Points points = random_points(db().extent(), 60000, random);
  for (const BlendOptions& options : all_blends()) {
    std::vector<Answers> answers;
    for (const std::size_t threads : {1, 2, 4, 8}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      answers.push_back(evaluate(db(), 2, points, options));
    }
    for (const Answers& a : answers) EXPECT_TRUE(a == answers[0]) << name_of(options);
  }
  report_law("SummationOrder", "the same bits on 1 to 8 threads", 24 * points.size());
}

// The naive form: five weighted terms in float32 in the order in which they come.
TEST_F(SummationOrder, SumsInTheOrderOfArrivalWouldChangeBits) {
  std::mt19937_64 random(test_seed(5));
  std::uniform_real_distribution<float> weight(0, 1), height(0, 2000);
  int changed = 0;
  for (int n = 0; n < 10000; ++n) {
    float w[5], h[5], up = 0, down = 0;
    for (int k = 0; k < 5; ++k) w[k] = weight(random), h[k] = height(random);
    for (int k = 0; k < 5; ++k) up += w[k] * h[k], down += w[4 - k] * h[4 - k];
    changed += up != down;
  }
  EXPECT_GT(changed, 3000) << "negative control";
}

TEST_F(SummationOrder, SameBitsForAnyOrderOfThePoints) {
  std::mt19937_64 random(test_seed(2));
  const Points points = random_points(db().extent(), 20000, random);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  Points shuffled;
  for (const std::size_t k : order) shuffled.add(points.x[k], points.y[k]);
  for (const BlendOptions& options : all_blends()) {
    const Answers a = evaluate(db(), 2, points, options), b = evaluate(db(), 2, shuffled, options);
    Answers c(points.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::size_t to = order[k];
      c.height[to] = b.height[k], c.bound[to] = b.bound[k];
      c.source[to] = b.source[k], c.patch[to] = b.patch[k];
    }
    EXPECT_TRUE(a == c) << name_of(options);
    EXPECT_FALSE(a == b) << "negative control: the order of the answers is that of the points";
  }
}

TEST_F(SummationOrder, SameBitsForPixelsPointsAndOnePointAtATime) {
  const RasterFrame raster{200.3, 2.9, 0.7, 1300.1, 0.5, -3.1};
  const int width = 233, rows = 171;
  Points points;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < width; ++c)
      points.add(raster.x0 + (raster.xc * c + raster.xr * r), raster.y0 + (raster.yc * c + raster.yr * r));
  for (const BlendOptions& options : all_blends()) {
    const Extraction x = extract(db(), {.error = 1});
    const Blend blend(db(), x.patches, options);
    Answers pixels(points.size());
    const int half = rows / 2;
    const std::size_t n = size_t(width) * size_t(half);
    blend.at_pixels(raster, width, 0, half, pixels.out());
    const auto rest = [&](auto& v) { return std::span(v).subspan(n); };
    blend.at_pixels(raster, width, half, rows - half,
                    {rest(pixels.height), rest(pixels.bound), rest(pixels.source), rest(pixels.patch)});
    Answers at_once(points.size());
    blend.at_points(points.x, points.y, at_once.out());
    EXPECT_TRUE(pixels == at_once) << name_of(options);
    for (std::size_t k = 0; k < points.size(); k += 97) {
      double height, bound;
      blend.at_points({&points.x[k], 1}, {&points.y[k], 1}, {{&height, 1}, {&bound, 1}, {}, {}});
      ASSERT_EQ(std::memcmp(&height, &at_once.height[k], 8), 0) << name_of(options);
      ASSERT_EQ(std::memcmp(&bound, &at_once.bound[k], 8), 0) << name_of(options);
    }
  }
}

TEST_F(SummationOrder, SameBitsOnTheFastPathAndOffIt) {
  std::mt19937_64 random(test_seed(3));
  const Points points = random_points(db().extent(), 20000, random);
  for (BlendOptions options : all_blends()) {
    const Answers fast = evaluate(db(), 5, points, options);
    options.fast_path = false;
    EXPECT_TRUE(fast == evaluate(db(), 5, points, options)) << name_of(options);
  }
}

TEST_F(SummationOrder, CountsAreThoseOfThePointsWhateverTheThreads) {
  std::mt19937_64 random(test_seed(4));
  const Points points = random_points(db().extent(), 30000, random);
  const Extraction x = extract(db(), {.error = 2});
  const Blend blend(db(), x.patches, {});
  std::vector<double> bound(points.size());
  const BlendCounts a = blend.at_points(points.x, points.y, {{}, bound, {}, {}});
  double largest = 0;
  for (const double b : bound)
    if (b > largest) largest = b;
  EXPECT_EQ(a.points, points.size());
  EXPECT_EQ(a.bound_max, largest);
  EXPECT_GE(a.contributions, points.size() / 2);
  EXPECT_GE(a.most, 2u);
}

TEST_F(SummationOrder, PointsThatAreNotFiniteOrOutsideHaveNoData) {
  Points points;
  const double far[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 1e9};
  for (const double v : far) points.add(v, 800), points.add(800, v), points.add(v, v);
  points.add(800, 800);
  for (const BlendOptions& options : all_blends()) {
    const Answers a = evaluate(db(), 1, points, options);
    for (std::size_t k = 0; k + 1 < points.size(); ++k) {
      EXPECT_TRUE(std::isnan(a.height[k]) && std::isnan(a.bound[k])) << points.x[k] << " " << points.y[k];
      EXPECT_EQ(a.source[k], 0);
      EXPECT_EQ(a.patch[k], -1);
    }
    EXPECT_TRUE(std::isfinite(a.height.back())) << "negative control: the last point is in the middle";
  }
}

TEST_F(SummationOrder, NoPointsAndNoPatchesAreAnsweredWithNothing) {
  const Extraction x = extract(db(), {.error = 1});
  EXPECT_EQ(Blend(db(), x.patches, {}).at_points({}, {}, {}).points, 0u);
  EXPECT_EQ(Blend(db(), x.patches, {}).at_pixels({}, 0, 0, 5, {}).points, 0u);
  Points one;
  one.add(800, 800);
  const Answers a = evaluate(db(), std::span<const PatchId>(), one);
  EXPECT_TRUE(std::isnan(a.height[0]));
}

}  // namespace
}  // namespace patchwork
