// The corridor: a polyline that needs more accuracy than its surroundings.
#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>
#include <cmath>
#include <limits>

#include "query/ranged_surface.h"

namespace patchwork {

namespace {

namespace bg = boost::geometry;

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
  explicit CorridorSurface(const CorridorCut& cut)
      : RangedSurface(cut.region), cut_(cut), sides_(sides_of(cut.line)) {}

  double at(Point p) const override {
    double nearest = kFar;
    each_near({p.x, p.y, p.x, p.y},
              [&](const Point& a, const Point& b) { nearest = std::min(nearest, distance(p, a, b)); });
    return tolerance(nearest);
  }
  ToleranceRange over(const Frame& f, const LatticeRect& r) const override {
    return over(f.corners(r), kHair);
  }

 protected:
  ToleranceRange within(const Extent& e) const override { return over(e.corners(), 2 * kHair); }

 private:
  using Corner = bg::model::point<double, 2, bg::cs::cartesian>;
  using Box = bg::model::box<Corner>;
  using Sides = bg::index::rtree<std::pair<Box, std::uint32_t>, bg::index::rstar<16>>;
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  static constexpr double kHair = 1e-9;  // of the distances, for their rounding

  // Each side of the line by its bounds and the point it begins at.
  static Sides sides_of(const std::vector<Point>& line) {
    std::vector<Sides::value_type> all;
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      const Point &a = line[k], &b = line[k + 1];
      all.emplace_back(
          Box({std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}),
          std::uint32_t(k));
    }
    return Sides(all);
  }
  // Calls visit(a, b) for the sides that are no further from `place` than the tolerance changes, and some
  // that are.
  template <class Visit>
  void each_near(const Extent& place, Visit visit) const {
    const double away = reach_ + slack(place, 4 * kHair);
    const Box around({place.xmin - away, place.ymin - away}, {place.xmax + away, place.ymax + away});
    sides_.query(bg::index::intersects(around),
                 boost::make_function_output_iterator([&](const Sides::value_type& side) {
                   visit(cut_.line[side.second], cut_.line[side.second + 1]);
                 }));
  }
  double slack(const Extent& e, double hair) const {
    return hair * (reach_ + std::hypot(e.xmax - e.xmin, e.ymax - e.ymin));
  }
  double tolerance(double d) const {
    const double t =
        cut_.ramp > 0 ? std::clamp((d - cut_.width) / cut_.ramp, 0.0, 1.0) : double(d > cut_.width);
    return cut_.error + t * (cut_.outside - cut_.error);
  }
  ToleranceRange over(const Corners& r, double hair) const {
    Extent place = Extent::nothing();
    for (const Point& p : r) place.add(p);
    Distances all{kFar, kFar};
    each_near(place, [&](const Point& a, const Point& b) {
      const Distances d = distances(r, a, b);
      all = {std::min(all.least, d.least), std::min(all.most, d.most)};
    });
    const double lost = slack(place, hair);
    const double a = tolerance(all.least - lost), b = tolerance(all.most + lost);
    return {std::min(a, b), std::max(a, b)};
  }
  CorridorCut cut_;
  double reach_ = cut_.width + cut_.ramp;  // metres: beyond it the tolerance is the same everywhere
  Sides sides_;
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
