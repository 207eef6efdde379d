// View cuts over the terrain that make_terrain makes, mountains, cliffs and a lake: at every point that is
// seen, the priority blend keeps to the tolerance wherever the data allow it, and to the terrain within its
// bound.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "blend/blend.h"
#include "query/extract.h"
#include "tests/grids.h"
#include "tests/seed.h"
#include "tools/terrain_function.h"

namespace patchwork {
namespace {

// Kernels that cover are grown by 1/1024 of a cell: in such a hairline a ramp is that far from 1.
constexpr double kHairline = 1.0 / 512;

// PATCHWORK_TRIALS=1000 takes as many cameras as the design asks for; then with 10^5 points each.
int cameras() { return test_trials(20); }
int points_a_camera() { return cameras() >= 1000 ? 100'000 : 5'000; }

class ViewCuts : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    terrain_ = new TerrainFunction({.extent = {0, 0, 10240, 10240}, .seed = 5});
    folder_ = new GridFolder;
    db_ = new Database(folder_->database());
    add("base", {.width = 513, .height = 513, .geotransform = {-10, 20, 0, 10250, 0, -20}});
    add("survey", {.width = 500, .height = 450, .geotransform = rotated(2500, 6000, 17, 6, 6)});
    add("detail", {.width = 400, .height = 400, .geotransform = rotated(4200, 7400, -33, 2, 3)});
  }
  static void TearDownTestSuite() { delete db_, delete folder_, delete terrain_; }

  static void add(const std::string& name, GridFile file) {
    file = of_terrain(file, [](double x, double y) { return terrain_->height(x, y); });
    const Frame frame = Frame::from_geotransform(file.geotransform, "test");
    file.accuracy = interpolation_error(*terrain_, frame, file.width, file.height);
    folder_->add(*db_, file, name);
  }

  // The smallest bottom of the patches whose kernels hold the point, of every grid and level.
  static double available(Point at) {
    double least = INFINITY;
    for (const Grid& g : db_->grids()) {
      const Point p = g.info.frame.to_lattice(at.x, at.y);
      const GridShape& s = g.info.shape;
      for (int level = 0; level < s.levels(); ++level) {
        const double block = std::ldexp(kKernelCells, level);
        const auto of = [&](double v, int blocks) {
          return std::clamp(int(std::floor(v / block)), 0, blocks - 1);
        };
        const int bx = of(p.x, s.blocks_i(level)), by = of(p.y, s.blocks_j(level));
        const LatticeRect k = s.kernel(level, bx, by);
        const PatchRecord& r = g.patches[s.index(level, bx, by)];
        if (r.exists() && p.x > k.i0 && p.x < k.i1 && p.y > k.j0 && p.y < k.j1)
          least = std::min(least, r.bottom);
      }
    }
    return least;
  }

  static TerrainFunction* terrain_;
  static GridFolder* folder_;
  static Database* db_;
};
TerrainFunction* ViewCuts::terrain_ = nullptr;
GridFolder* ViewCuts::folder_ = nullptr;
Database* ViewCuts::db_ = nullptr;

bool inside(const std::vector<Point>& corners, const Point& at) {
  if (corners.size() < 3) return false;
  for (std::size_t c = 0; c < corners.size(); ++c) {
    const Point &p = corners[c], &q = corners[(c + 1) % corners.size()];
    if ((q.x - p.x) * (at.y - p.y) - (q.y - p.y) * (at.x - p.x) <= 0) return false;
  }
  return true;
}

// Points of the extent that the footprint holds; fewer where it holds next to none.
std::vector<Point> seen_points(const Extent& e, const std::vector<Point>& corners, std::mt19937_64& random) {
  Extent b = Extent::nothing();
  for (const Point& c : corners) b.add(c);
  b = b.common(e);
  std::vector<Point> points;
  if (!(b.xmin < b.xmax && b.ymin < b.ymax)) return points;
  std::uniform_real_distribution<double> x(b.xmin, b.xmax), y(b.ymin, b.ymax);
  for (int tries = 0; tries < 20 * points_a_camera() && int(points.size()) < points_a_camera(); ++tries)
    if (const Point p{x(random), y(random)}; inside(corners, p)) points.push_back(p);
  return points;
}

TEST_F(ViewCuts, KeepToTheToleranceWhereverTheDataAllow) {
  std::mt19937_64 random(test_seed(31));
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const Extent e = db_->extent();
  std::size_t asked_for = 0, coarse = 0, diluted = 0;
  double worst = 0;
  for (int n = 0; n < cameras(); ++n) {
    const Point eye{uniform(e.xmin, e.xmax), uniform(e.ymin, e.ymax)};
    ViewCut view{.eye = {eye.x, eye.y, terrain_->height(eye.x, eye.y) + std::exp2(uniform(1, 11))},
                 .look = {uniform(e.xmin, e.xmax), uniform(e.ymin, e.ymax), uniform(0, 1000)},
                 .fov_degrees = uniform(20, 90),
                 .pixel_error = std::exp2(uniform(-1, 5)),
                 .in_space = n % 2 == 1};
    view = over_terrain_of(*db_, view);
    const auto cut = make_surface(view);
    const Extraction x = extract(*db_, view);
    const std::vector<Point> points = seen_points(e, footprint(view), random);
    std::vector<double> px, py, truth(points.size()), height(points.size()), bound(points.size()),
        weighted(points.size());
    for (const Point& p : points) px.push_back(p.x), py.push_back(p.y);
    terrain_->heights(px, py, truth);
    const Database::Reading reading = db_->reading();
    Blend(*db_, x.patches, {})
        .at_points(px, py, {.height = height, .bound = bound, .source = {}, .patch = {}});
    Blend(*db_, x.patches, {.composition = Composition::weighted})
        .at_points(px, py, {.height = {}, .bound = weighted, .source = {}, .patch = {}});
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double asked = cut->at(points[k]);
      ASSERT_FALSE(std::isnan(height[k])) << "no data at " << px[k] << " " << py[k];
      ASSERT_LE(std::abs(height[k] - truth[k]), bound[k])
          << "camera " << n << " at " << px[k] << " " << py[k];
      if (available(points[k]) > asked) continue;
      ++asked_for, worst = std::max(worst, bound[k] - asked);
      ASSERT_LE(bound[k], asked + kHairline * x.bound_max)
          << "camera " << n << " at " << px[k] << " " << py[k];
      coarse += bound[k] > 2 * available(points[k]), diluted += weighted[k] > asked + kHairline * x.bound_max;
    }
  }
  std::printf("%d cameras, %zu points where the tolerance is available; at most %.3g m above it\n", cameras(),
              asked_for, worst);
  EXPECT_GT(asked_for, std::size_t(cameras()) * 500u);
  EXPECT_GT(coarse, asked_for / 50) << "coarser patches are used where they will do";
  EXPECT_GT(diluted, 0u) << "negative control: the weighted blend is diluted by coarse neighbours";
}

}  // namespace
}  // namespace patchwork
