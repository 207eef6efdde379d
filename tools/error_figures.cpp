#include "tools/error_figures.h"

#include <algorithm>
#include <cmath>

namespace patchwork::cli {

ErrorFigures figures_of(std::vector<double>& distances) {
  if (distances.empty()) return {};
  double squares = 0;
  for (const double d : distances) squares += d * d;
  std::sort(distances.begin(), distances.end());
  const std::size_t n = distances.size();
  return {distances.back(), distances[std::size_t(0.99 * double(n - 1))], std::sqrt(squares / double(n))};
}

std::vector<double> screen_distances(const Blend& best, const Camera& camera, std::span<const float> depth,
                                     int every) {
  std::vector<double> x, y, z, scale;
  for (int r = 0; r < camera.height; r += every)
    for (int c = 0; c < camera.width; c += every) {
      const float d = depth[std::size_t(r) * std::size_t(camera.width) + std::size_t(c)];
      if (std::isnan(d)) continue;
      const glm::dvec3 p = ray(camera, c, r).at(double(d));
      const Seen low = see(camera, {p.x, p.y, p.z - 0.005}), high = see(camera, {p.x, p.y, p.z + 0.005});
      x.push_back(p.x), y.push_back(p.y), z.push_back(p.z);
      scale.push_back(std::hypot(high.x - low.x, high.y - low.y) / 0.01);
    }
  std::vector<double> height(x.size()), all;
  best.at_points(x, y, {.height = height, .bound = {}, .source = {}, .patch = {}});
  for (std::size_t k = 0; k < x.size(); ++k)
    if (!std::isnan(height[k])) all.push_back(std::abs(z[k] - height[k]) * scale[k]);
  return all;
}

}  // namespace patchwork::cli
