// The corridor: a polyline that needs more accuracy than its surroundings.
#include <algorithm>
#include <cmath>
#include <limits>

#include "query/ranged_surface.h"

namespace patchwork {

namespace {

double distance(const Point& p, const Point& a, const Point& b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length = dx * dx + dy * dy;
  const double t = length > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / length, 0.0, 1.0) : 0;
  return std::hypot(p.x - (a.x + t * dx), p.y - (a.y + t * dy));
}

bool cross(const Point& a, const Point& b, const Point& p, const Point& q) {
  return (turn(a, b, p) > 0) != (turn(a, b, q) > 0) && (turn(p, q, a) > 0) != (turn(p, q, b) > 0);
}

bool holds(const Corners& r, const Point& p) {
  int left = 0;
  for (std::size_t k = 0; k < 4; ++k) left += turn(r[k], r[(k + 1) % 4], p) >= 0;
  return left == 0 || left == 4;
}

struct Distances {
  double least, most;  // metres
};

// From the segment to points of the rectangle: the largest is at a corner, because the distance from a convex
// set is convex.
Distances distances(const Corners& r, const Point& a, const Point& b) {
  Distances d{holds(r, a) ? 0 : std::numeric_limits<double>::infinity(), 0};
  for (std::size_t k = 0; k < 4; ++k) {
    const Point &p = r[k], &q = r[(k + 1) % 4];
    const double corner = distance(p, a, b);
    d.least = cross(a, b, p, q) ? 0 : std::min({d.least, corner, distance(a, p, q), distance(b, p, q)});
    d.most = std::max(d.most, corner);
  }
  return d;
}

// What holds a rectangle has a range that holds the rectangle's: pages are passed by only where none of their
// patches is meant. (Distances from a centre, give or take half a diagonal, do not have that property.)
class CorridorSurface : public RangedSurface {
 public:
  explicit CorridorSurface(const CorridorCut& cut) : RangedSurface(cut.region), cut_(cut) {}

  double at(Point p) const override {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k + 1 < cut_.line.size(); ++k)
      nearest = std::min(nearest, distance(p, cut_.line[k], cut_.line[k + 1]));
    return tolerance(nearest);
  }
  ToleranceRange over(const Frame& f, const LatticeRect& r) const override {
    return over(f.corners(r), kHair);
  }

 protected:
  ToleranceRange within(const Extent& e) const override { return over(e.corners(), 2 * kHair); }

 private:
  static constexpr double kHair = 1e-9;  // of the distances, for their rounding

  double tolerance(double d) const {
    const double t =
        cut_.ramp > 0 ? std::clamp((d - cut_.width) / cut_.ramp, 0.0, 1.0) : double(d > cut_.width);
    return cut_.error + t * (cut_.outside - cut_.error);
  }
  ToleranceRange over(const Corners& r, double hair) const {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    Distances all{kFar, kFar};
    for (std::size_t k = 0; k + 1 < cut_.line.size(); ++k) {
      const Distances d = distances(r, cut_.line[k], cut_.line[k + 1]);
      all = {std::min(all.least, d.least), std::min(all.most, d.most)};
    }
    const double slack = hair * (all.most + std::hypot(r[2].x - r[0].x, r[2].y - r[0].y));
    const double a = tolerance(all.least - slack), b = tolerance(all.most + slack);
    return {std::min(a, b), std::max(a, b)};
  }
  CorridorCut cut_;
};

}  // namespace

std::unique_ptr<CutSurface> make_surface(const CorridorCut& c) {
  require(c.line.size() >= 2, "corridor", "its line needs at least two points");
  for (const Point& p : c.line)
    require(std::isfinite(p.x) && std::isfinite(p.y), "corridor", "a point of its line is not finite");
  for (const double e : {c.error, c.outside, c.width, c.ramp})
    require(is_error(e), "corridor", "errors and widths must be metres, 0 or more");
  return std::make_unique<CorridorSurface>(c);
}

}  // namespace patchwork
