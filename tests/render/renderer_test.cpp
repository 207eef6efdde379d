// Pictures of the terrain against the blend itself: error on the screen, cracks, the near plane, what is made
// anew.
#include <gtest/gtest.h>

#include <random>

#include "render/renderer.h"
#include "tests/blend/vulkan_scene.h"
#include "tests/render/ray_cast.h"

namespace patchwork {
namespace {

constexpr int kWidth = 256, kHeight = 144;

class TerrainTest : public VulkanTest {
 protected:
  static void SetUpTestSuite() { land_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static Renderer renderer(double pixel_error, bool published = false) {
    return {test_device(),
            db(),
            {.width = kWidth,
             .height = kHeight,
             .pixel_error = pixel_error,
             .memory = std::size_t{256} << 20,
             .published = published}};
  }
  static std::unique_ptr<Land> land_;
};
std::unique_ptr<Land> TerrainTest::land_;

// Somewhere over the terrain, looking anywhere but up.
Camera random_camera(const Database& db, std::mt19937_64& random) {
  const Extent e = db.extent();
  std::uniform_real_distribution<double> x(e.xmin, e.xmax), y(e.ymin, e.ymax), up(5, 400), way(-1, 1),
      tilt(-1.2, 0.1);
  const Point3 eye{x(random), y(random), 400 + up(random)};
  return {eye, {eye.x + way(random), eye.y + way(random), eye.z + tilt(random)}, 60, kWidth, kHeight};
}

// Pixels of vertical distance between what was drawn and the best surface there is.
struct ScreenError {
  std::size_t pixels = 0;
  double worst = 0;
};

ScreenError screen_error(const Database& db, const Blend& best, const Camera& camera,
                         const std::vector<float>& depth) {
  Points points;
  std::vector<double> z, scale;
  const CameraAxes a = axes(camera);
  for (int r = 0; r < camera.height; ++r)
    for (int c = 0; c < camera.width; ++c) {
      const float d = depth[std::size_t(r * camera.width + c)];
      if (std::isnan(d)) continue;
      const glm::dvec3 p = ray(camera, c, r).at(double(d));
      points.add(p.x, p.y), z.push_back(p.z);
      // Where a metre of height here is seen, in pixels.
      const Seen low = see(camera, {p.x, p.y, p.z - 0.005}), high = see(camera, {p.x, p.y, p.z + 0.005});
      scale.push_back(std::hypot(high.x - low.x, high.y - low.y) / 0.01);
    }
  (void)a;
  Answers answers(points.size());
  best.at_points(points.x, points.y, answers.out());
  ScreenError e;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (answers.source[k] == 0) continue;  // the outline of the data is drawn to a cell
    ++e.pixels;
    e.worst = std::max(e.worst, std::abs(z[k] - answers.height[k]) * scale[k]);
  }
  (void)db;
  return e;
}

TEST_F(TerrainTest, TessellationError) {
  std::mt19937_64 random(test_seed(21));
  const Extraction x = extract(db(), {.error = 0});
  const Blend best(db(), x.patches, {.smoothness = 1});
  std::size_t pixels = 0;
  for (const double tau : {0.5, 1.0, 2.0, 4.0}) {
    Renderer r = renderer(tau);
    double worst = 0;
    for (int n = 0; n < 12; ++n) {
      const Camera camera = random_camera(db(), random);
      const FrameStats stats = r.draw(camera);
      EXPECT_LE(stats.pixels_reached, tau) << "all of the terrain is there";
      EXPECT_EQ(stats.tiles_wanted, 0u);
      const ScreenError e = screen_error(db(), best, camera, r.depth());
      EXPECT_LE(e.worst, tau * 1.001 + 0.01) << "tau " << tau << " view " << n;
      worst = std::max(worst, e.worst), pixels += e.pixels;
    }
    std::printf("asked %g px, reached at most %.3f px\n", tau, worst);
  }
  EXPECT_GT(pixels, 100000u);
}

}  // namespace
}  // namespace patchwork
