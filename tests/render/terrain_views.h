// Views of a terrain for tests, and how far what was drawn is off.
#pragma once

#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "render/renderer.h"
#include "tests/blend/vulkan_scene.h"
#include "tests/render/ray_cast.h"

namespace patchwork {

inline constexpr int kWidth = 256, kHeight = 144;

// Those that keep to what is asked.
inline constexpr std::pair<const char*, Tessellation> kWays[] = {{"hardware", Tessellation::hardware},
                                                                 {"mesh", Tessellation::mesh}};

class TerrainTest : public VulkanTest {
 protected:
  static void SetUpTestSuite() { land_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static Renderer renderer(double pixel_error, std::optional<Tessellation> tessellation = {}) {
    return {test_device(),
            db(),
            {.width = kWidth,
             .height = kHeight,
             .pixel_error = pixel_error,
             .memory = std::size_t{256} << 20,
             .tessellation = tessellation}};
  }
  inline static std::unique_ptr<Land> land_;
};

// Somewhere over the terrain, looking anywhere but up.
inline Camera random_camera(const Database& db, std::mt19937_64& random) {
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

inline ScreenError screen_error(const Blend& best, const Camera& camera, const std::vector<float>& depth) {
  Points points;
  std::vector<double> z, scale;
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
  Answers answers(points.size());
  best.at_points(points.x, points.y, answers.out());
  ScreenError e;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (answers.source[k] == 0) continue;  // the outline of the data is drawn to a cell
    ++e.pixels;
    e.worst = std::max(e.worst, std::abs(z[k] - answers.height[k]) * scale[k]);
  }
  return e;
}

/// Pixels of background between drawn ones on all four sides: no terrain looks so where it is whole, since
/// what is behind it lies above it.
inline std::size_t pinholes(const Camera& camera, const std::vector<float>& depth) {
  const auto drawn = [&](int c, int r) { return !std::isnan(depth[std::size_t(r * camera.width + c)]); };
  std::size_t n = 0;
  for (int r = 1; r + 1 < camera.height; ++r)
    for (int c = 1; c + 1 < camera.width; ++c)
      n += !drawn(c, r) && drawn(c - 1, r) && drawn(c + 1, r) && drawn(c, r - 1) && drawn(c, r + 1);
  return n;
}

}  // namespace patchwork
