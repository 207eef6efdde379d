#include "tools/cost/check_points.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "blend/vulkan/vulkan_blend.h"
#include "db/error.h"

namespace patchwork::cli {

namespace {

// What an evaluator in float32 may differ by (blend/vulkan/vulkan_blend.h), metres; in double, by rounding.
double slack(double height, bool float32) {
  return float32 ? VulkanBlend::departure(height) : 1e-9 * (1 + std::abs(height));
}

}  // namespace

CheckPoints::CheckPoints(const Database& db, const Extent& extent, int count) {
  const int side = std::max(2, int(std::lround(std::sqrt(double(count)))));
  const double dx = (extent.xmax - extent.xmin) / side, dy = (extent.ymax - extent.ymin) / side;
  std::mt19937_64 random(1);  // the same points in every run
  std::uniform_real_distribution<double> within(0, 1);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      x_.push_back(extent.xmin + (i + within(random)) * dx);
      y_.push_back(extent.ymin + (j + within(random)) * dy);
    }
  best_.resize(size()), best_bound_.resize(size());
  const Extraction all = extract(db, {.error = 0, .region = Region::inside(extent)});
  Blend(db, all.patches, {})
      .at_points(x_, y_, {.height = best_, .bound = best_bound_, .source = {}, .patch = {}});
  if (std::all_of(best_.begin(), best_.end(), [](double h) { return std::isnan(h); }))
    throw Error(db.path(), "there is no height where its cost is to be measured", "name another --extent");
}

void CheckPoints::compare(const Evaluator& surface, std::span<const double> scale, bool float32,
                          CostRow& row) const {
  std::vector<double> height(size()), bound(size());
  surface.at_points(x_, y_, {.height = height, .bound = bound, .source = {}, .patch = {}});
  std::vector<double> distances, bounds;
  for (std::size_t k = 0; k < size(); ++k) {
    const double unit = scale.empty() ? 1 : scale[k];
    if (unit < 0 || std::isnan(best_[k])) continue;
    const double off = std::abs(height[k] - best_[k]);
    // Both are within their bounds of the terrain, so no farther apart than both together.
    row.beyond += !(off <= bound[k] + best_bound_[k] + slack(height[k], float32));
    if (std::isnan(off)) continue;
    distances.push_back(off * unit), bounds.push_back(bound[k] * unit);
  }
  const ErrorFigures guaranteed = figures_of(bounds);
  row.bound = guaranteed.max, row.bound_p99 = guaranteed.p99, row.error = figures_of(distances);
}

ErrorFigures CheckPoints::figures(std::span<const double> heights, std::span<const double> scale) const {
  std::vector<double> distances;
  for (std::size_t k = 0; k < size(); ++k) {
    const double unit = scale.empty() ? 1 : scale[k], off = std::abs(heights[k] - best_[k]) * unit;
    if (unit >= 0 && !std::isnan(off)) distances.push_back(off);
  }
  return figures_of(distances);
}

}  // namespace patchwork::cli
