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

// Distances over a rectangle lie within half its diagonal of that at its centre: a range that is a little too
// wide, which a field may have.
class CorridorSurface : public RangedSurface {
 public:
  explicit CorridorSurface(const CorridorCut& cut) : RangedSurface(cut.region), cut_(cut) {}

  double at(Point p) const override { return tolerance(from_line(p)); }
  ToleranceRange over(const Frame& frame, const LatticeRect& r) const override {
    const Point a = frame.to_domain(r.i0, r.j0), b = frame.to_domain(r.i1, r.j1);
    return around({0.5 * (a.x + b.x), 0.5 * (a.y + b.y)}, 0.5 * std::hypot(b.x - a.x, b.y - a.y));
  }

 protected:
  ToleranceRange within(const Extent& e) const override {
    return around({0.5 * (e.xmin + e.xmax), 0.5 * (e.ymin + e.ymax)},
                  0.5 * std::hypot(e.xmax - e.xmin, e.ymax - e.ymin));
  }

 private:
  double from_line(const Point& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k + 1 < cut_.line.size(); ++k)
      nearest = std::min(nearest, distance(p, cut_.line[k], cut_.line[k + 1]));
    return nearest;
  }
  double tolerance(double d) const {
    const double t =
        cut_.ramp > 0 ? std::clamp((d - cut_.width) / cut_.ramp, 0.0, 1.0) : double(d > cut_.width);
    return cut_.error + t * (cut_.outside - cut_.error);
  }
  ToleranceRange around(const Point& centre, double radius) const {
    const double d = from_line(centre), slack = 1e-9 * (d + radius);
    const double a = tolerance(d - radius - slack), b = tolerance(d + radius + slack);
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
