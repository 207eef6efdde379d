#include "render/camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "query/cut.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

Camera random_camera(std::mt19937_64& random) {
  std::uniform_real_distribution<double> metres(-5000, 5000), fov(10, 120);
  const Point3 eye{500000 + metres(random), 5000000 + metres(random), metres(random)};
  return {
      eye, {eye.x + metres(random), eye.y + metres(random), eye.z + metres(random)}, fov(random), 1280, 720};
}

TEST(Camera, LookIsSeenInTheMiddle) {
  std::mt19937_64 random(test_seed(1));
  for (int n = 0; n < 100; ++n) {
    const Camera c = random_camera(random);
    const Seen s = see(c, c.look);
    EXPECT_NEAR(s.x, 640, 1e-6);
    EXPECT_NEAR(s.y, 360, 1e-6);
    EXPECT_NEAR(s.distance, glm::distance(vec(c.eye), vec(c.look)), 1e-6);
    EXPECT_NEAR(s.axial, s.distance, 1e-6);
  }
}

TEST(Camera, APointOnAPixelsRayIsSeenAtThePixelsCentre) {
  std::mt19937_64 random(test_seed(2));
  std::uniform_int_distribution<int> column(0, 1279), row(0, 719);
  for (int n = 0; n < 1000; ++n) {
    const Camera c = random_camera(random);
    const int i = column(random), j = row(random);
    const Seen s = see(c, point(ray(c, i, j).at(1234)));
    EXPECT_NEAR(s.x, i + 0.5, 1e-5);
    EXPECT_NEAR(s.y, j + 0.5, 1e-5);
    EXPECT_NEAR(s.distance, 1234, 1e-6);
    EXPECT_NEAR(s.axial, s.distance * axial_share(c, i + 0.5, j + 0.5), 1e-6);
  }
}

TEST(Camera, MatricesSeeWhatRaysSee) {
  std::mt19937_64 random(test_seed(3));
  for (int n = 0; n < 1000; ++n) {
    const Camera c = random_camera(random);
    const double far = n % 2 ? std::numeric_limits<double>::infinity() : 20000;
    const glm::dvec3 p = ray_through(c, n % 1280, n % 720).at(50 + n);
    const glm::dmat4 m = projection(c, 0.5, far) * glm::dmat4(view_rotation(c));
    const glm::dvec4 clip = m * glm::dvec4(p - vec(c.eye), 1);
    const Seen s = see(c, point(p));
    EXPECT_NEAR(clip.w, s.axial, 1e-6);
    EXPECT_NEAR((clip.x / clip.w + 1) * 640, s.x, 1e-5);
    EXPECT_NEAR((clip.y / clip.w + 1) * 360, s.y, 1e-5) << "Vulkan's y points down";
    EXPECT_NEAR(axial_of_depth(clip.z / clip.w, 0.5, far), s.axial, 1e-5);
  }
}

TEST(Camera, DepthIsOneAtTheNearPlaneAndZeroAtTheFarOne) {
  const Camera c{{0, 0, 0}, {0, 1, 0}, 60, 1280, 720};
  const auto depth = [&](double z, double far) {
    const glm::dvec4 clip = projection(c, 0.1, far) * glm::dvec4(0, 0, -z, 1);
    return clip.z / clip.w;
  };
  EXPECT_DOUBLE_EQ(depth(0.1, 1000), 1);
  EXPECT_NEAR(depth(1000, 1000), 0, 1e-15);
  EXPECT_DOUBLE_EQ(depth(0.1, INFINITY), 1);
  EXPECT_DOUBLE_EQ(depth(1e9, INFINITY), 1e-10);
}

// The cut's pixel is the camera's pixel: 1 m across the line of sight, gamma metres ahead, is one pixel.
TEST(Camera, GammaIsThatOfTheViewCut) {
  const Camera c{{0, 0, 0}, {0, 1000, 0}, 50, 1280, 720};
  const Seen s = see(c, {1, c.gamma(), 0});
  EXPECT_NEAR(s.x - 640, 1, 1e-9);
  const ViewCut cut{.eye = c.eye, .look = c.look, .fov_degrees = 50, .height = 720, .far = 1e5};
  EXPECT_NEAR(make_surface(cut)->at({0, c.gamma()}), 1, 1e-9);
}

TEST(Camera, FootprintHoldsWhatThePictureSees) {
  std::mt19937_64 random(test_seed(4));
  int seen = 0;
  for (int n = 0; n < 200; ++n) {
    const Camera c = random_camera(random);
    const ViewCut cut{.eye = c.eye, .look = c.look, .fov_degrees = c.fov_degrees, .far = 30000};
    const std::vector<Point> corners = footprint(cut);  // of the plane z = 0
    for (const Point p : corners) {
      // Corners of the plane's part in view lie on the picture's rim or on the far plane.
      const Seen s = see(c, {p.x, p.y, 0});
      if (s.axial > 29999) continue;
      const double rim = std::min({std::abs(s.x), std::abs(s.x - 1280), std::abs(s.y), std::abs(s.y - 720)});
      EXPECT_LT(rim, 1e-3);
      ++seen;
    }
  }
  EXPECT_GT(seen, 50);
}

TEST(Camera, StraightDownHasNorthOnTop) {
  const Camera c{{10, 20, 500}, {10, 20, 0}, 60, 1280, 720};
  EXPECT_LT(see(c, {10, 120, 0}).y, 360);
  EXPECT_GT(see(c, {110, 20, 0}).x, 640);
}

TEST(Camera, OverviewSeesAllOfTheTerrain) {
  const Extent e{500000, 5000000, 530000, 5010000};
  for (const int width : {200, 1280, 4000}) {
    const Camera c = overview(e, -100, 3000, 45, width, 720);
    for (const double x : {e.xmin, e.xmax})
      for (const double y : {e.ymin, e.ymax})
        for (const double z : {-100.0, 3000.0}) {
          const Seen s = see(c, {x, y, z});
          EXPECT_GT(s.axial, 0);
          EXPECT_TRUE(s.x >= 0 && s.x <= width && s.y >= 0 && s.y <= 720) << s.x << ' ' << s.y;
        }
  }
}

}  // namespace
}  // namespace patchwork
