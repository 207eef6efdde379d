#include "query/region.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <sstream>

#include "db/error.h"

namespace patchwork {

namespace {

namespace bg = boost::geometry;
using Vertex = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Vertex>;

Polygon polygon_of(const std::vector<Point>& corners) {
  Polygon p;
  for (const Point& c : corners) bg::append(p.outer(), Vertex(c.x, c.y));
  bg::correct(p);
  return p;
}

std::vector<Point> corners_of(const Frame& frame, const LatticeRect& r) {
  return {frame.to_domain(r.i0, r.j0), frame.to_domain(r.i1, r.j0), frame.to_domain(r.i1, r.j1),
          frame.to_domain(r.i0, r.j1)};
}

}  // namespace

Region Region::inside(const Extent& e) {
  if (!(e.xmin <= e.xmax && e.ymin <= e.ymax) || !std::isfinite(e.xmax - e.xmin) ||
      !std::isfinite(e.ymax - e.ymin))
    throw Error("extent", "it must be xmin ymin xmax ymax with xmin <= xmax and ymin <= ymax");
  Region r;
  r.bounds_ = e;
  return r;
}

Region Region::inside(std::vector<Point> corners) {
  if (corners.size() < 3) throw Error("polygon", "it needs at least three corners");
  Region r;
  r.bounds_ = {INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (const Point& p : corners) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) throw Error("polygon", "a corner is not finite");
    r.bounds_ = {std::min(r.bounds_.xmin, p.x), std::min(r.bounds_.ymin, p.y), std::max(r.bounds_.xmax, p.x),
                 std::max(r.bounds_.ymax, p.y)};
  }
  r.corners_ = std::move(corners);
  return r;
}

std::vector<Point> parse_points(const std::string& what, const std::string& text) {
  std::string numbers = text;
  const std::size_t open = numbers.find_last_of('('), close = numbers.find(')');
  if (open != std::string::npos && close != std::string::npos && open < close)
    numbers = numbers.substr(open + 1, close - open - 1);
  std::replace(numbers.begin(), numbers.end(), ',', ' ');
  std::istringstream in(numbers);
  std::vector<Point> corners;
  bool paired = true;
  for (Point p; in >> p.x;) {
    paired = bool(in >> p.y);
    if (paired) corners.push_back(p);
  }
  if (!in.eof() || !paired)
    throw Error(what, "cannot read \"" + text + "\"", "write it as \"x y, x y, x y\"");
  return corners;
}

Region Region::parse_polygon(const std::string& text) { return inside(parse_points("polygon", text)); }

bool Region::contains(Point p) const {
  if (!bounds_.contains(p)) return false;
  bool inside = corners_.empty();
  for (std::size_t k = 0; k < corners_.size(); ++k) {  // sides to the right of it: an odd number
    const Point &a = corners_[k], &b = corners_[(k + 1) % corners_.size()];
    if ((a.y > p.y) != (b.y > p.y)) inside ^= p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y));
  }
  return inside;
}

bool Region::meets(const Grid& grid, const GridShape::Block& b) const {
  const LatticeRect domain = grid.info.shape.domain(b.level, b.bx, b.by);
  if (!grid.info.frame.bounds(domain).meets(bounds_)) return false;
  const bool rotated = grid.info.frame.numbers()[2] != 0 || grid.info.frame.numbers()[4] != 0;
  if (corners_.empty() && (!rotated || bounds_.xmin < -1e299)) return true;
  const Polygon patch = polygon_of(corners_of(grid.info.frame, domain));
  if (!corners_.empty()) return bg::intersects(patch, polygon_of(corners_));
  return bg::intersects(patch,
                        bg::model::box<Vertex>({bounds_.xmin, bounds_.ymin}, {bounds_.xmax, bounds_.ymax}));
}

}  // namespace patchwork
