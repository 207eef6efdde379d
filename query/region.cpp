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

Polygon polygon_of(const Frame& frame, const LatticeRect& r) {
  Polygon p;
  for (const Point c : frame.corners(r)) bg::append(p.outer(), Vertex(c.x, c.y));
  bg::correct(p);
  return p;
}

constexpr std::size_t kMostSlabs = 1024;

}  // namespace

// A polygon with its sides by slabs of y, so that a place meets few of them.
struct Region::Outline {
  struct Side {
    Point a, b;
    Extent bounds() const {
      return {std::min(a.x, b.x), std::min(a.y, b.y), std::max(a.x, b.x), std::max(a.y, b.y)};
    }
  };
  double ymin, slabs_a_metre;
  std::vector<std::vector<Side>> slabs;

  Outline(const std::vector<Point>& corners, const Extent& e)
      : ymin(e.ymin), slabs(std::min(corners.size(), kMostSlabs)) {
    slabs_a_metre = e.ymax > e.ymin ? double(slabs.size()) / (e.ymax - e.ymin) : 0;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Side side{corners[k], corners[(k + 1) % corners.size()]};
      for (std::size_t s = slab(side.bounds().ymin); s <= slab(side.bounds().ymax); ++s)
        slabs[s].push_back(side);
    }
  }

  // The first one, too, where a polygon is so flat or so high that this is no number.
  std::size_t slab(double y) const {
    const double at = (y - ymin) * slabs_a_metre;
    return at > 0 ? std::size_t(std::min(at, double(slabs.size() - 1))) : 0;
  }
  bool contains(Point p) const {
    bool inside = false;
    for (const auto& [a, b] : slabs[slab(p.y)])  // sides to the right of it: an odd number
      if ((a.y > p.y) != (b.y > p.y)) inside ^= p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y));
    return inside;
  }
  bool crosses(const Polygon& patch, const Extent& around) const {
    for (std::size_t s = slab(around.ymin); s <= slab(around.ymax); ++s)
      for (const Side& side : slabs[s])
        if (side.bounds().meets(around) &&
            bg::intersects(bg::model::segment<Vertex>({side.a.x, side.a.y}, {side.b.x, side.b.y}), patch))
          return true;
    return false;
  }
};

Region Region::inside(const Extent& e) {
  if (!(e.xmin <= e.xmax && e.ymin <= e.ymax) || !std::isfinite(e.xmax - e.xmin) ||
      !std::isfinite(e.ymax - e.ymin))
    throw Error("extent", "it must be xmin ymin xmax ymax with xmin <= xmax and ymin <= ymax");
  Region r;
  r.bounds_ = e;
  return r;
}

Region Region::inside(const std::vector<Point>& corners) {
  if (corners.size() < 3) throw Error("polygon", "it needs at least three corners");
  Region r;
  r.bounds_ = Extent::nothing();
  for (const Point& p : corners) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) throw Error("polygon", "a corner is not finite");
    r.bounds_.add(p);
  }
  r.outline_ = std::make_shared<const Outline>(corners, r.bounds_);
  return r;
}

std::vector<Point> parse_points(const std::string& what, const std::string& text) {
  std::string numbers = text;
  const std::size_t open = numbers.find_last_of('('), close = numbers.find(')');
  if (open != std::string::npos && close != std::string::npos && open < close)
    numbers = numbers.substr(open + 1, close - open - 1);
  std::vector<Point> corners;
  std::size_t has = 0;  // numbers of each point: a height of WKT's does not matter
  std::istringstream points(numbers);
  bool good = true;
  for (std::string one; good && std::getline(points, one, ',');) {
    std::istringstream in(one);
    std::vector<double> v;
    for (double number; in >> number;) v.push_back(number);
    good = in.eof() && (v.size() == 2 || v.size() == 3) && (has == 0 || v.size() == has);
    has = v.size();
    if (good) corners.push_back({v[0], v[1]});
  }
  if (!good) throw Error(what, "cannot read \"" + text + "\"", "write it as \"x y, x y, x y\"");
  return corners;
}

Region Region::parse_polygon(const std::string& text) { return inside(parse_points("polygon", text)); }

bool Region::contains(Point p) const { return bounds_.contains(p) && (!outline_ || outline_->contains(p)); }

bool Region::meets(const Grid& grid, const GridShape::Block& b) const {
  const LatticeRect domain = grid.info.shape.domain(b.level, b.bx, b.by);
  const Extent around = grid.info.frame.bounds(domain);
  if (!around.meets(bounds_)) return false;
  const Frame& f = grid.info.frame;
  // A polygon without a side in the patch holds all of it, or nothing.
  if (outline_)
    return outline_->crosses(polygon_of(f, domain), around) ||
           outline_->contains(f.to_domain(domain.i0, domain.j0));
  const bool rotated = f.numbers()[2] != 0 || f.numbers()[4] != 0;
  const Extent& e = bounds_;
  if (!rotated || (e.contains({around.xmin, around.ymin}) && e.contains({around.xmax, around.ymax})))
    return true;
  // Two convex sets are apart if a side of one of them parts them: here a patch's.
  const LatticeRect seen = f.lattice_bounds(e.corners());
  return seen.i0 <= domain.i1 && domain.i0 <= seen.i1 && seen.j0 <= domain.j1 && domain.j0 <= seen.j1;
}

}  // namespace patchwork
