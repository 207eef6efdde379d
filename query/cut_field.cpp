// The field: a raster of tolerances, with a pyramid of its least and largest values.
#include <algorithm>
#include <cmath>

#include "query/ranged_surface.h"

namespace patchwork {

namespace {

// One level of the pyramid: a pixel holds the range over 2^level x 2^level pixels of the raster.
struct FieldLevel {
  int width = 0, height = 0;
  std::vector<float> low, high;
};

FieldLevel halved(const FieldLevel& fine) {
  FieldLevel coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}, {}};
  coarse.low.assign(std::size_t(coarse.width) * std::size_t(coarse.height), INFINITY);
  coarse.high.assign(coarse.low.size(), 0);
  for (int j = 0; j < fine.height; ++j)
    for (int i = 0; i < fine.width; ++i) {
      const std::size_t from = std::size_t(j) * std::size_t(fine.width) + std::size_t(i);
      const std::size_t to = std::size_t(j / 2) * std::size_t(coarse.width) + std::size_t(i / 2);
      coarse.low[to] = std::min(coarse.low[to], fine.low[from]);
      coarse.high[to] = std::max(coarse.high[to], fine.high[from]);
    }
  return coarse;
}

// Pixel (i, j) speaks for the square around its centre. A range is exact where the rectangle spans few
// pixels, else that of the coarser pixels which it meets: a little too wide, which a field may have.
class FieldSurface : public RangedSurface {
 public:
  explicit FieldSurface(const FieldCut& cut)
      : RangedSurface(cut.region), frame_(cut.frame), outside_(cut.outside) {
    FieldLevel level{cut.width, cut.height, cut.tolerance, {}};
    for (float& e : level.low)
      if (std::isnan(e)) e = float(outside_);
    level.high = level.low;
    levels_.push_back(std::move(level));
    while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(halved(levels_.back()));
  }

  double at(Point p) const override {
    const Point l = frame_.to_lattice(p.x, p.y);
    const double i = std::floor(l.x + 0.5), j = std::floor(l.y + 0.5);
    const FieldLevel& f = levels_.front();
    if (!(i >= 0 && j >= 0 && i < f.width && j < f.height)) return outside_;
    return double(f.low[std::size_t(j) * std::size_t(f.width) + std::size_t(i)]);
  }
  ToleranceRange over(const Frame& frame, const LatticeRect& r) const override {
    return around(frame.corners(r));
  }

 protected:
  ToleranceRange within(const Extent& e) const override { return around(e.corners()); }

 private:
  static constexpr double kMostPixels = 8;  // along each side, that a range is taken over
  static constexpr double kHair = 1e-6;     // of a pixel: what rounding may move a corner

  ToleranceRange around(const Corners& corners) const {
    auto [i0, j0, i1, j1] = frame_.lattice_bounds(corners);
    i0 = std::floor(i0 + 0.5 - kHair), j0 = std::floor(j0 + 0.5 - kHair);
    i1 = std::floor(i1 + 0.5 + kHair), j1 = std::floor(j1 + 0.5 + kHair);
    const FieldLevel& whole = levels_.front();
    ToleranceRange r{INFINITY, 0};
    if (!(i0 >= 0 && j0 >= 0 && i1 < whole.width && j1 < whole.height)) r = {outside_, outside_};
    if (!(i1 >= 0 && j1 >= 0 && i0 < whole.width && j0 < whole.height)) return r;
    return united(r, int(std::max(i0, 0.0)), int(std::max(j0, 0.0)),
                  int(std::min<double>(i1, whole.width - 1)), int(std::min<double>(j1, whole.height - 1)));
  }
  ToleranceRange united(ToleranceRange r, int i0, int j0, int i1, int j1) const {
    std::size_t at = 0;
    for (; std::max(i1 - i0, j1 - j0) >= kMostPixels; ++at) i0 /= 2, j0 /= 2, i1 /= 2, j1 /= 2;
    const FieldLevel& f = levels_[at];
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i) {
        const std::size_t k = std::size_t(j) * std::size_t(f.width) + std::size_t(i);
        r.low = std::min(r.low, double(f.low[k])), r.high = std::max(r.high, double(f.high[k]));
      }
    return r;
  }

  Frame frame_;
  double outside_;
  std::vector<FieldLevel> levels_;
};

}  // namespace

std::unique_ptr<CutSurface> make_surface(const FieldCut& c) {
  require(c.width > 0 && c.height > 0, "field", "it has no pixels");
  require(c.tolerance.size() == std::size_t(c.width) * std::size_t(c.height), "field",
          "its tolerances are not width x height");
  require(is_error(c.outside), "field", "the tolerance outside must be metres, 0 or more");
  for (const float e : c.tolerance)
    require(std::isnan(e) || is_error(double(e)), "field", "a tolerance is negative or infinite");
  return std::make_unique<FieldSurface>(c);
}

}  // namespace patchwork
