#include "render/camera_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "db/error.h"

namespace patchwork {

namespace {

// Fritsch and Carlson, "Monotone piecewise cubic interpolation" (1980), with Butland's harmonic mean; level
// at both ends.
class Monotone {
 public:
  Monotone(const std::vector<double>& x, std::vector<double> y) : x_(x), y_(std::move(y)), slope_(y_.size()) {
    for (std::size_t k = 1; k + 1 < y_.size(); ++k) {
      const double a = secant(k - 1), b = secant(k);
      if (a * b > 0) slope_[k] = 2 * a * b / (a + b);
    }
  }
  double at(double x) const {
    const std::size_t k = std::min(
        std::size_t(std::max<std::ptrdiff_t>(0, std::upper_bound(x_.begin(), x_.end(), x) - x_.begin() - 1)),
        y_.size() - 2);
    const double h = x_[k + 1] - x_[k], t = std::clamp((x - x_[k]) / h, 0.0, 1.0), u = 1 - t;
    return u * u * (1 + 2 * t) * y_[k] + t * t * (1 + 2 * u) * y_[k + 1] +
           h * t * u * (u * slope_[k] - t * slope_[k + 1]);
  }

 private:
  double secant(std::size_t k) const { return (y_[k + 1] - y_[k]) / (x_[k + 1] - x_[k]); }
  const std::vector<double>& x_;
  std::vector<double> y_, slope_;
};

double interpolated(const std::vector<double>& knots, const std::vector<Point3>& points, double Point3::*axis,
                    double s) {
  std::vector<double> values;
  for (const Point3& p : points) values.push_back(p.*axis);
  return Monotone(knots, std::move(values)).at(s);
}

std::vector<Point> in_plane(const std::vector<Point3>& points) {
  std::vector<Point> plane;
  for (const Point3& p : points) plane.push_back({p.x, p.y});
  return plane;
}

}  // namespace

CameraPath::CameraPath(const Flight& flight)
    : flight_(flight), arcs_(clothoids_through(in_plane(flight.points))), knots_{0} {
  for (const Clothoid& arc : arcs_) knots_.push_back(knots_.back() + arc.length);
  if (frames() > Flight::kMostFrames)
    throw Error("path",
                fmt::format("it has {} frames or more, {} at most are drawn", frames(), Flight::kMostFrames),
                "fly faster, or say how many with \"frames\"");
}

int CameraPath::frames() const {
  if (flight_.frames) return *flight_.frames;
  // A hair: a way of exactly n steps has n + 1 frames, whatever the rounding.
  return 1 + int(std::min(1e9, length() * flight_.frames_per_second / flight_.speed + 1e-9));
}

double CameraPath::distance_of(int frame) const {
  if (!flight_.frames) return frame * flight_.speed / flight_.frames_per_second;
  return *flight_.frames == 1 ? 0 : length() * frame / (*flight_.frames - 1);
}

CameraPath::Along CameraPath::along(double s) const {
  const double inside = std::clamp(s, 0.0, length());
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), inside) - knots_.begin();
  const std::size_t k = std::min(std::size_t(next) - 1, arcs_.size() - 1);
  return {arcs_[k], inside - knots_[k], s - inside};
}

Point3 CameraPath::eye(double s) const {
  const Along a = along(s);
  const Point p = a.arc.at(a.s);
  const double h = a.arc.heading_at(a.s);
  return {p.x + a.beyond * std::cos(h), p.y + a.beyond * std::sin(h),
          interpolated(knots_, flight_.points, &Point3::z, s)};
}

double CameraPath::heading(double s) const {
  const Along a = along(s);
  return a.arc.heading_at(a.s);
}

double CameraPath::curvature(double s) const {
  const Along a = along(s);
  return a.beyond != 0 ? 0 : a.arc.curvature_at(a.s);
}

Point3 CameraPath::target(double s) const {
  const std::vector<Point3>& t = flight_.targets;
  if (t.size() == 1) return t.front();
  return {interpolated(knots_, t, &Point3::x, s), interpolated(knots_, t, &Point3::y, s),
          interpolated(knots_, t, &Point3::z, s)};
}

Camera CameraPath::at(double s, int width, int height) const {
  const Point3 from = eye(s);
  if (!flight_.targets.empty()) {
    const Point3 to = target(s);
    // An eye that flies through its target has nothing to look at there.
    if (std::hypot(to.x - from.x, to.y - from.y, to.z - from.z) > 1e-3)
      return {from, to, flight_.fov_degrees, width, height};
  }
  const double h = heading(s + flight_.look_ahead), rise = flight_.pitch * kDegree;
  const double away = 1000, level = away * std::cos(rise);
  const Point3 to{from.x + level * std::cos(h), from.y + level * std::sin(h), from.z + away * std::sin(rise)};
  return {from, to, flight_.fov_degrees, width, height};
}

}  // namespace patchwork
