// BoundHolds (hard cases): no height leaves its bound, and priority keeps to the bound that was asked for.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

constexpr double kErrors[] = {0, 1, 5, 20, 100};
// Kernels that cover are grown by 1/1024 of a cell: in such a hairline a ramp is that far from 1.
constexpr double kHairline = 1.0 / 512;

class BoundHolds : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { scene_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { scene_.reset(); }
  static const Database& db() { return scene_->db(); }
  static std::unique_ptr<Land> scene_;
};
std::unique_ptr<Land> BoundHolds::scene_;

TEST_F(BoundHolds, AgainstTheTerrainThatWasSurveyed) {
  std::mt19937_64 random(test_seed(1));
  const Points points = random_points(db().extent(), 20000, random);
  double closest = 0;
  for (const double e : kErrors)
    for (const BlendOptions& options : all_blends()) {
      const Answers a = evaluate(db(), e, points, options);
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (a.source[k] == 0) continue;
        const double off = std::abs(a.height[k] - hills(points.x[k], points.y[k]));
        closest = std::max(closest, off / a.bound[k]);
        ASSERT_LE(off, a.bound[k]) << name_of(options) << " error " << e << " at " << points.x[k] << " "
                                   << points.y[k];
      }
    }
  EXPECT_GT(closest, 0.5) << "negative control: half the bound would do, so this test could not fail";
  report_case("BoundHolds", "against the true terrain, every blend, 5 errors", 30 * points.size(), closest, 1,
              "of the bound");
}

TEST_F(BoundHolds, IsWhatWasAskedForWhereverAKernelOffersIt) {
  std::mt19937_64 random(test_seed(2));
  const Points points = random_points(db().extent(), 4000, random);
  std::vector<double> asked(std::begin(kErrors), std::end(kErrors));
  for (const Grid& g : db().grids()) asked.push_back(g.info.accuracy + g.info.quantisation);
  std::size_t weighted_beyond = 0;
  for (const double e : asked) {
    std::vector<bool> offered(points.size());
    each_patch(db(), [&](const Grid& g, std::size_t index, const GridShape::Block& b) {
      if (g.patches[index].bottom > e) return;
      const LatticeRect kernel = g.info.shape.kernel(b.level, b.bx, b.by);
      for (std::size_t k = 0; k < points.size(); ++k)
        if (!offered[k]) offered[k] = holds(g, kernel, {points.x[k], points.y[k]});
    });
    const Extraction x = extract(db(), {.error = e});
    for (int smoothness = 0; smoothness <= 2; ++smoothness) {
      // At level 0 a smooth surface may depart further from the samples' than the bottom says (grid.h).
      double most = e;
      for (const PatchId id : x.patches)
        if (db().patch(id).bottom <= e) most = std::max(most, db().patch(id).error[size_t(smoothness)]);
      const Answers a = evaluate(db(), x.patches, points, {.smoothness = smoothness});
      for (std::size_t k = 0; k < points.size(); ++k)
        if (offered[k]) {
          ASSERT_LE(a.bound[k], most + kHairline * x.bound_max)
              << "k=" << smoothness << " error " << e << " at " << points.x[k] << " " << points.y[k];
        }
    }
    const Answers w = evaluate(db(), x.patches, points, {.composition = Composition::weighted});
    for (std::size_t k = 0; k < points.size(); ++k)
      weighted_beyond += offered[k] && w.bound[k] > e + kHairline * x.bound_max;
  }
  EXPECT_GT(weighted_beyond, 0u) << "negative control: the weighted blend is diluted by coarse neighbours";
}

// PATCHWORK_TRIALS=1000 takes as many cameras, and points a camera, as the design asks for.
int cameras() { return test_trials(40); }

TEST_F(BoundHolds, UnderViewsWhereverAKernelOffersIt) {
  const auto offers = [](double error, Point at) {
    bool offered = false;
    each_patch(db(), [&](const Grid& g, std::size_t index, const GridShape::Block& b) {
      offered |= g.patches[index].bottom <= error && holds(g, g.info.shape.kernel(b.level, b.bx, b.by), at);
    });
    return offered;
  };
  std::mt19937_64 random(test_seed(4));
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const Extent e = db().extent();
  std::array<std::size_t, 3> seen{}, weighted_beyond{};
  std::array<double, 3> closest{};
  std::size_t finer = 0, answered = 0;
  double of_bound = 0;
  for (int n = 0; n < cameras(); ++n) {
    const double ground = uniform(250, 350);
    ViewCut view{.eye = {uniform(e.xmin, e.xmax), uniform(e.ymin, e.ymax), ground + uniform(5, 600)},
                 .look = {uniform(e.xmin, e.xmax), uniform(e.ymin, e.ymax), ground},
                 .fov_degrees = uniform(20, 80),
                 .pixel_error = std::exp2(uniform(0, 6))};
    view = over_terrain_of(db(), view);
    const auto surface = make_surface(view);
    const Extraction x = extract(db(), view);
    std::vector<PatchRecord> records;
    double largest = x.bound_max;
    for (const PatchId id : x.patches) {
      records.push_back(db().patch(id));
      for (const double error : records.back().error) largest = std::max(largest, error);
    }
    const double slack = kHairline * largest;
    // At level 0 a smooth surface may depart further from the samples' than the bottom says
    // (patch_records.h).
    const auto most_at = [&](std::size_t k, double asked, Point at) {
      double most = asked;
      for (std::size_t p = 0; p < records.size(); ++p) {
        const PatchId id = x.patches[p];
        const Grid& g = db().grid(id.grid());
        if (records[p].bottom <= asked && records[p].error[k] > most &&
            holds(g, g.info.shape.domain(id.level(), id.bx(), id.by()), at))
          most = records[p].error[k];
      }
      return most;
    };
    const Points points = random_points(e, cameras() >= 1000 ? 100000 : 1500, random);
    const std::vector<Point> corners = footprint(view);
    std::vector<double> asked(points.size(), -1);  // where a kernel offers it in view
    for (std::size_t p = 0; p < points.size(); ++p) {
      bool inside = corners.size() >= 3;
      for (std::size_t c = 0; inside && c < corners.size(); ++c) {
        const Point &a = corners[c], &b = corners[(c + 1) % corners.size()];
        inside = (b.x - a.x) * (points.y[p] - a.y) - (b.y - a.y) * (points.x[p] - a.x) > 0;
      }
      const Point at{points.x[p], points.y[p]};
      if (inside && offers(surface->at(at), at)) asked[p] = surface->at(at);
    }
    const Answers best = evaluate(db(), 0, points);
    for (const BlendOptions& options : all_blends()) {
      const auto k = std::size_t(options.smoothness);
      const Answers a = evaluate(db(), x.patches, points, options);
      for (std::size_t p = 0; p < points.size(); ++p) {
        const Point at{points.x[p], points.y[p]};
        if (a.source[p] == 0) {
          ASSERT_LT(asked[p], 0) << name_of(options) << ": a kernel offers it, nothing answers";
          continue;
        }
        const double off = std::abs(a.height[p] - hills(at.x, at.y));
        ++answered, of_bound = std::max(of_bound, off / a.bound[p]);
        ASSERT_LE(off, a.bound[p]) << name_of(options) << " at " << at.x << " " << at.y;
        if (asked[p] < 0) continue;
        const double most = most_at(k, asked[p], at);
        if (options.composition == Composition::weighted) {
          weighted_beyond[k] += a.bound[p] > most + slack;
          continue;
        }
        ++seen[k], closest[k] = std::max(closest[k], (a.bound[p] - slack) / most);
        ASSERT_LE(a.bound[p], most + slack) << name_of(options) << " at " << at.x << " " << at.y;
        finer += k == 0 && a.bound[p] > best.bound[p];
      }
    }
  }
  EXPECT_GT(finer, 100u) << "coarser patches are used where they will do";
  EXPECT_GT(of_bound, 0.5) << "negative control: half the bound would do, so this test could not fail";
  report_case("BoundHolds", "against the true terrain under view cuts, every blend", answered, of_bound, 1,
              "of the bound");
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GT(seen[k], 1000u);
    report_case("BoundHolds", "bound of priority under view cuts, k=" + std::to_string(k), seen[k],
                closest[k], 1, "of what was asked");
    EXPECT_GT(weighted_beyond[k], 0u)
        << "negative control: the weighted blend is diluted by coarse neighbours, k=" << k;
  }
}

TEST_F(BoundHolds, OfOneGridAgainstItsOwnBilinearSurface) {
  const GridFile file =
      survey({.width = 150, .height = 130, .geotransform = rotated(100, 1500, 25, 9, 7)}, 0.3);
  const Land one({file});
  const Grid& g = one.db().grids()[0];
  std::mt19937_64 random(test_seed(3));
  std::uniform_real_distribution<double> i(0, file.width - 1), j(0, file.height - 1);
  Points points;
  std::vector<double> surface;
  for (int k = 0; k < 20000; ++k) {
    // Every fourth point on a vertex, where the distance of bilinear patches is largest.
    const double u = k % 4 ? i(random) : std::round(i(random)), v = k % 4 ? j(random) : std::round(j(random));
    const int a = std::min(int(u), file.width - 2), b = std::min(int(v), file.height - 2);
    const double s = u - a, t = v - b;
    surface.push_back((1 - t) * ((1 - s) * file.at(a, b) + s * file.at(a + 1, b)) +
                      t * ((1 - s) * file.at(a, b + 1) + s * file.at(a + 1, b + 1)));
    points.add(g.info.frame.to_domain(u, v));
  }
  for (const double e : kErrors)
    for (const BlendOptions& options : all_blends()) {
      const Answers answers = evaluate(one.db(), e, points, options);
      double closest = 0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const double off = std::abs(answers.height[k] - surface[k]);
        const double allowed = answers.bound[k] - g.info.accuracy + 1e-4;  // float32 samples
        closest = std::max(closest, off / allowed);
        ASSERT_LE(off, allowed) << name_of(options) << " error " << e;
      }
      if (options.smoothness == 0 && options.composition == Composition::priority && e >= 5) {
        EXPECT_GT(closest, 0.5) << "negative control: half the bound would do at error " << e;
      }
    }
}

// The half cell beyond the outer samples is extrapolated, and its bound is larger: it must not be mixed into
// places where another patch keeps to the error.
TEST(BoundAtTheRim, OfAPixelIsAreaGridKeepsToTheErrorOfWhatLiesBelow) {
  GridFile rough{.width = 60, .height = 60, .geotransform = {600, 5, 0, 500, 0, -5}, .accuracy = 0.1};
  rough.at = [](int i, int j) { return 100 + 4.0 * ((i * 7 + j * 13) % 5); };
  // The base does not cover the rough grid's kernels, or it would hide them at its own error.
  GridFile base{.width = 80, .height = 80, .geotransform = {0, 10, 0, 800, 0, -10}, .accuracy = 1};
  base.at = [](int, int) { return 105.0; };
  const Land scene({base, rough});
  std::mt19937_64 random(test_seed(4));
  Points points = random_points({600, 200, 720, 202.5}, 500, random);
  for (const BlendOptions& options : all_blends()) {
    if (options.composition != Composition::priority) continue;
    const Answers a = evaluate(scene.db(), 1.0, points, options);
    for (std::size_t k = 0; k < points.size(); ++k)
      ASSERT_LE(a.bound[k], 1.0) << name_of(options) << " at " << points.x[k] << " " << points.y[k];
  }
}

// A mean of equal bounds is that bound: rounding must not put it above what was asked for.
TEST(StrictBlend, AnswersEverywhereWhereTheErrorIsExactlyWhatThereIs) {
  std::vector<GridFile> grids;
  for (int n = 0; n < 4; ++n) {
    GridFile g{.width = 60, .height = 50, .geotransform = rotated(100.0 * n, 300, 13.0 * n, 5, 5)};
    g.accuracy = 0.1, g.at = [](int, int) { return 50.0; };
    grids.push_back(g);
  }
  const Land scene(grids);
  const double e = scene.db().grids()[0].at(0, 0, 0).bottom;
  std::mt19937_64 random(test_seed(5));
  const Points points = random_points(scene.db().extent(), 20000, random);
  for (BlendOptions options : all_blends()) {
    const Answers loose = evaluate(scene.db(), e, points, options);
    options.strict = true;
    const Answers strict = evaluate(scene.db(), e, points, options);
    EXPECT_TRUE(loose == strict) << name_of(options);
    options.error = e;
    const Answers below = evaluate(scene.db(), e / 2, points, options);
    EXPECT_EQ(std::count(below.source.begin(), below.source.end(), 0), std::ptrdiff_t(points.size()))
        << "negative control: half the error is not available";
  }
}

// A view sees terrain between two planes: nothing of a grid's surface may lie beyond them, neither half a
// cell outside its samples nor where a smooth interpolant swings past a tower.
TEST(SurfaceHeights, HoldEverySurfaceOfAGrid) {
  const auto steep = [](int i, int j) { return 3.0 * i - 2.0 * j; };
  const auto tower = [](int i, int j) { return i / 2 == 15 && j / 2 == 17 ? 100.0 : 0.0; };
  const auto rough = [](int i, int j) { return 40 * std::sin(1.9 * i + 0.3 * j) * std::cos(2.3 * j); };
  const auto with_holes = [=](int i, int j) {
    return (i - 20) * (i - 20) + (j - 9) * (j - 9) < 30 ? NAN : rough(i, j) + steep(i, j);
  };
  std::mt19937_64 random(test_seed(31));
  double closest = 0, beyond_samples = INFINITY;
  for (const auto& at : std::vector<std::function<double(int, int)>>{steep, tower, rough, with_holes})
    for (const bool area : {true, false}) {
      GridFile file{
          .width = 50, .height = 40, .geotransform = rotated(0, 0, 20, 10, 10), .pixel_is_area = area};
      file.nodata = -9999, file.at = at;
      const Land land({file});
      const GridInfo& g = land.db().grids()[0].info;
      const HeightRange all = g.surface_heights();
      double lowest = INFINITY, highest = -INFINITY;
      Points points = random_points(land.db().extent(), 60000, random);
      const LatticeRect rim = g.shape.footprint();
      for (int n = 0; n <= 4000; ++n) {
        const double i = rim.i0 + (rim.i1 - rim.i0) * n / 4000, j = rim.j0 + (rim.j1 - rim.j0) * n / 4000;
        points.add(g.frame.to_domain(i, rim.j0)), points.add(g.frame.to_domain(i, rim.j1));
        points.add(g.frame.to_domain(rim.i0, j)), points.add(g.frame.to_domain(rim.i1, j));
      }
      for (int k = 0; k <= 2; ++k)
        for (const double h : evaluate(land.db(), 0, points, {.smoothness = k}).height)
          if (!std::isnan(h)) lowest = std::min(lowest, h), highest = std::max(highest, h);
      ASSERT_LT(lowest, highest);
      EXPECT_GE(lowest, all.lowest);
      EXPECT_LE(highest, all.highest);
      const double past = std::max(g.lowest - lowest, highest - g.highest);
      closest = std::max(closest, past / g.overshoot), beyond_samples = std::min(beyond_samples, past);
    }
  EXPECT_GT(closest, 0.6) << "and it is no wider than it must be";
  EXPECT_LT(beyond_samples, 1e-3) << "a plane of samples alone has none";
}

}  // namespace
}  // namespace patchwork
