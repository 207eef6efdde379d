#include "blend/volume.h"

#include <algorithm>
#include <cmath>

namespace patchwork {

namespace {

// A level plane without error.
class Plane : public Evaluator {
 public:
  explicit Plane(double height) : height_(height) {}
  BlendCounts at_points(std::span<const double>, std::span<const double>,
                        const BlendOutput& out) const override {
    return fill(out);
  }
  BlendCounts at_pixels(const RasterFrame&, int, int, int, const BlendOutput& out) const override {
    return fill(out);
  }

 private:
  BlendCounts fill(const BlendOutput& out) const {
    std::fill(out.height.begin(), out.height.end(), height_);
    std::fill(out.bound.begin(), out.bound.end(), 0.0);
    std::fill(out.source.begin(), out.source.end(), 1);
    return {};
  }
  double height_;
};

// Column by column, in pixels.
class Sums {
 public:
  void add(double difference, double bound) {
    if (std::isnan(difference)) {
      ++missing_;
      return;
    }
    ++both_, error_ += bound, undecided_ += std::abs(difference) <= bound;
    add(above_, difference, bound), add(below_, -difference, bound);
  }
  Volume times(double pixel) const {
    const auto scaled = [&](const VolumePart& p) {
      return VolumePart{p.area * pixel, p.volume * pixel, p.least * pixel, p.most * pixel};
    };
    return {scaled(above_),
            scaled(below_),
            double(both_) * pixel,
            double(missing_) * pixel,
            double(undecided_) * pixel,
            error_ * pixel};
  }

 private:
  static void add(VolumePart& part, double height, double bound) {
    part.area += height > 0, part.volume += std::max(0.0, height);
    part.least += std::max(0.0, height - bound), part.most += std::max(0.0, height + bound);
  }
  VolumePart above_, below_;
  std::size_t both_ = 0, missing_ = 0, undecided_ = 0;
  double error_ = 0;
};

}  // namespace

Volume volume_between(const Evaluator& surface, const Evaluator& other, const Area& area) {
  Sums sums;
  scan_area(surface, &other, area, [&](const AreaRow& row) {
    for (std::size_t c = 0; c < row.height.size(); ++c)
      if (!area.inside || area.inside(area.centre(int(c), row.row)))
        sums.add(row.height[c] - row.other_height[c], row.bound[c] + row.other_bound[c]);
  });
  return sums.times(area.pixel());
}

Volume volume_over_plane(const Evaluator& surface, double height, const Area& area) {
  return volume_between(surface, Plane(height), area);
}

}  // namespace patchwork
