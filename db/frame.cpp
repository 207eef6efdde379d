#include "db/frame.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "db/error.h"

namespace patchwork {

Frame::Frame(const std::array<double, 6>& n) : n_(n) {
  const double det = n[1] * n[5] - n[2] * n[4];
  inverse_ = {n[5] / det, -n[2] / det, -n[4] / det, n[1] / det};
}

Frame Frame::from_geotransform(const std::array<double, 6>& gt, const std::string& where) {
  if (!std::all_of(gt.begin(), gt.end(), [](double v) { return std::isfinite(v); }))
    throw Error(where, "its geotransform is not finite", "georeference the file again");
  const double si = std::hypot(gt[1], gt[4]), sj = std::hypot(gt[2], gt[5]);
  if (!(si * sj > 0) || !std::isfinite(si * sj) || !std::isfinite(1 / (si * sj)))
    throw Error(where, "its geotransform has a step of zero", "georeference the file again");
  const Frame frame(
      {gt[0] + 0.5 * gt[1] + 0.5 * gt[2], gt[1], gt[2], gt[3] + 0.5 * gt[4] + 0.5 * gt[5], gt[4], gt[5]});
  if (!(std::abs(frame.cosine()) <= kMostShear))
    throw Error(where, "its geotransform is sheared (axes not at right angles)",
                "warp it first, e.g. with gdalwarp");
  return frame;
}

double Frame::step_i() const { return std::hypot(n_[1], n_[4]); }
double Frame::step_j() const { return std::hypot(n_[2], n_[5]); }
double Frame::finer_step() const { return std::min(step_i(), step_j()); }
double Frame::cell_area() const { return std::abs(n_[1] * n_[5] - n_[2] * n_[4]); }
double Frame::cosine() const { return (n_[1] * n_[2] + n_[4] * n_[5]) / (step_i() * step_j()); }
double Frame::angle_degrees() const { return std::atan2(n_[4], n_[1]) * 180 / std::numbers::pi; }

Extent Frame::bounds(const LatticeRect& r) const {
  Extent e = Extent::nothing();
  for (const Point p : corners(r)) e.add(p);
  // What is added may cancel: rounding goes by its parts.
  const double i = std::max(std::abs(r.i0), std::abs(r.i1)), j = std::max(std::abs(r.j0), std::abs(r.j1));
  const auto lost = [&](double from, double by_i, double by_j) {
    return 0x1p-51 * (std::abs(from) + std::abs(by_i) * i + std::abs(by_j) * j);
  };
  const double x = lost(n_[0], n_[1], n_[2]), y = lost(n_[3], n_[4], n_[5]);
  return {e.xmin - x, e.ymin - y, e.xmax + x, e.ymax + y};
}

}  // namespace patchwork
