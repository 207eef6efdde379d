#include "blend/accuracy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace patchwork {

namespace {

// Bounds by size, in steps of 1/70 octave (1 %) from a micrometre on.
class Histogram {
 public:
  // Within a patch bounds are alike, so the last place is most often the next.
  void add(double bound) {
    if (bound != last_) last_ = bound, at_ = place(bound);
    ++counts_[at_], ++all_;
  }
  /// The upper end of the step that holds the share; no more than `most`.
  double quantile(double share, double most) const {
    std::size_t seen = 0;
    for (std::size_t k = 0; k < counts_.size(); ++k)
      if (seen += counts_[k]; double(seen) >= share * double(all_))
        return std::min(most, kLeast * std::exp2(double(k) / kSteps));
    return most;
  }

 private:
  static constexpr double kLeast = 1e-6, kSteps = 70;
  static std::size_t place(double bound) {
    const double octaves = bound > kLeast ? std::log2(bound / kLeast) : 0;
    return std::min(std::size_t(std::ceil(octaves * kSteps)), std::size_t{3999});
  }
  std::array<std::size_t, 4000> counts_{};
  std::size_t all_ = 0, at_ = 0;
  double last_ = NAN;
};

}  // namespace

Accuracy accuracy_over(const Evaluator& surface, const Area& area, std::size_t grids) {
  Accuracy a;
  std::vector<std::size_t> by_source(grids);
  Histogram histogram;
  double sum = 0;
  std::size_t answered = 0, missing = 0, filled = 0;
  scan_area(surface, nullptr, area, [&](const AreaRow& row) {
    for (int c = 0; c < area.width; ++c) {
      const Point at = area.centre(c, row.row);
      if (area.inside && !area.inside(at)) continue;
      const std::int32_t source = row.source[std::size_t(c)];
      const double bound = row.bound[std::size_t(c)];
      if (source == 0) {
        ++missing;
        continue;
      }
      ++answered, filled += source < 0, sum += bound, histogram.add(bound);
      ++by_source[std::size_t(std::abs(source)) - 1];
      if (!(bound >= a.best.bound)) a.best = {bound, at};
      if (!(bound <= a.worst.bound)) a.worst = {bound, at};
    }
  });
  a.answered = double(answered) * area.pixel(), a.missing = double(missing) * area.pixel();
  a.filled = double(filled) * area.pixel();
  for (const std::size_t pixels : by_source) a.by_source.push_back(double(pixels) * area.pixel());
  if (answered == 0) return a;
  a.mean = sum / double(answered);
  a.median = histogram.quantile(0.5, a.worst.bound), a.p95 = histogram.quantile(0.95, a.worst.bound);
  return a;
}

}  // namespace patchwork
