// The view: a tolerance that grows with the distance from an eye, over what it sees.
#include <algorithm>
#include <array>
#include <cmath>

#include "query/cut.h"
#include "query/ranged_surface.h"
#include "query/view_page.h"

namespace patchwork {

namespace {

using Vector = std::array<double, 3>;
Vector operator+(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vector operator*(double s, const Vector& a) { return {s * a[0], s * a[1], s * a[2]}; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector normalised(const Vector& a) { return (1 / std::hypot(a[0], a[1], a[2])) * a; }

// Andrew's monotone chain (1979). Each point is a corner at most once of the lower chain, once of the upper.
std::vector<Point> convex_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  points.erase(std::unique(points.begin(), points.end(),
                           [](const Point& a, const Point& b) { return a.x == b.x && a.y == b.y; }),
               points.end());
  if (points.size() < 3) return {};
  std::vector<Point> hull;
  const auto add = [&](const Point& p, std::size_t least) {
    while (hull.size() >= least + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
    hull.push_back(p);
  };
  for (const Point& p : points) add(p, 0);
  const std::size_t lower = hull.size();
  for (std::size_t k = points.size() - 1; k-- > 0;) add(points[k], lower - 1);
  hull.pop_back();
  return hull;
}

void expect_sound(const ViewCut& v) {
  // So that neither squares of lengths, times what a wide picture makes of them, nor their reciprocals
  // overflow.
  constexpr double kMost = 1e100, kLeast = 1 / kMost;
  for (const double n : {v.eye.x, v.eye.y, v.eye.z, v.look.x, v.look.y, v.look.z, v.lowest, v.highest, v.far})
    require(std::abs(n) <= kMost, "view", "eye, look, far and heights must be metres, up to 1e100");
  require(std::hypot(v.look.x - v.eye.x, v.look.y - v.eye.y, v.look.z - v.eye.z) >= kLeast, "view",
          "eye and look are the same point");
  require(v.fov_degrees > 0 && v.fov_degrees < 180, "fov", "it must be between 0 and 180 degrees");
  require(v.width > 0 && v.height > 0, "size", "width and height must be pixels, at least 1");
  require(v.pixel_error >= 0 && v.pixel_error <= kMost, "pixel-error",
          "it must be a number of pixels, 0 to 1e100");
  require(v.far > 0 && v.lowest <= v.highest, "view", "it has no extent");
}

class ViewSurface : public CutSurface {
 public:
  explicit ViewSurface(const ViewCut& cut)
      : corners_(footprint(cut)),
        view_({cut.eye.x, cut.eye.y},
              cut.in_space ? std::max({0.0, cut.eye.z - cut.highest, cut.lowest - cut.eye.z}) : 0,
              cut.pixel_error * 2 * std::tan(cut.fov_degrees * (M_PI / 360)) / cut.height, corners_) {}

  double at(Point p) const override {
    return view_.slope * std::hypot(p.x - view_.eye.x, p.y - view_.eye.y, view_.above);
  }

  // Axis by axis, as if they were orthogonal: where they are not quite, a squared length is that of its parts
  // but for their cosine's share, at most.
  ToleranceRange over(const Frame& frame, const LatticeRect& r) const override {
    const Point e = frame.to_lattice(view_.eye.x, view_.eye.y);
    const double i = frame.step_i(), j = frame.step_j(), shear = std::abs(frame.cosine());
    const double least = std::sqrt(1 - shear), most = std::sqrt(1 + shear);
    const auto near = [](double v, double a, double b) { return std::max({a - v, v - b, 0.0}); };
    const auto far = [](double v, double a, double b) { return std::max(std::abs(a - v), std::abs(b - v)); };
    const auto tolerance = [&](double x, double y) { return view_.slope * std::hypot(x, y, view_.above); };
    return {tolerance(least * i * near(e.x, r.i0, r.i1), least * j * near(e.y, r.j0, r.j1)),
            tolerance(most * i * far(e.x, r.i0, r.i1), most * j * far(e.y, r.j0, r.j1))};
  }

  // Two convex sets are apart if a side of one of them parts them.
  bool meets(const Grid& grid, const GridShape::Block& b) const override {
    if (view_.sides == 0) return false;
    const LatticeRect d = grid.info.shape.domain(b.level, b.bx, b.by);
    const Frame& f = grid.info.frame;
    const Corners rect = f.corners(d);
    for (std::size_t k = 0; k < view_.sides; ++k)
      if (std::all_of(rect.begin(), rect.end(), [&](const Point& p) { return view_.beyond(k, p); }))
        return false;
    const LatticeRect seen = f.lattice_bounds(corners_);
    return seen.i0 <= d.i1 && d.i0 <= seen.i1 && seen.j0 <= d.j1 && d.j0 <= seen.j1;
  }

  LodHits hits(const LodPage& page, bool inside) const override { return view_.hits(page, inside); }

 private:
  std::vector<Point> corners_;
  PageView view_;
};

}  // namespace

std::vector<Point> footprint(const ViewCut& v) {
  expect_sound(v);
  const Vector eye{v.eye.x, v.eye.y, v.eye.z};
  const Vector forward = normalised({v.look.x - v.eye.x, v.look.y - v.eye.y, v.look.z - v.eye.z});
  const bool steep = std::hypot(forward[0], forward[1]) < 1e-9;
  const Vector right = normalised(cross(forward, steep ? Vector{0, 1, 0} : Vector{0, 0, 1}));
  const Vector up = cross(right, forward);
  const double ty = std::tan(v.fov_degrees * (M_PI / 360)), tx = ty * v.width / v.height;
  const auto corner = [&](double a, double b) {
    return eye + v.far * (forward + (a * tx) * right + (b * ty) * up);
  };
  const Vector corners[] = {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)};
  // The corners of the pyramid between the planes of the lowest and the highest terrain.
  std::vector<Point> points;
  const auto clip = [&](const Vector& a, const Vector& b) {
    for (const Vector& p : {a, b})
      if (p[2] >= v.lowest && p[2] <= v.highest) points.push_back({p[0], p[1]});
    for (const double z : {v.lowest, v.highest})
      if ((a[2] < z) != (b[2] < z)) {
        const double t = (z - a[2]) / (b[2] - a[2]);
        points.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
      }
  };
  for (int k = 0; k < 4; ++k) clip(eye, corners[k]), clip(corners[k], corners[(k + 1) % 4]);
  return convex_hull(std::move(points));
}

bool sees(std::span<const Point> corners, Point p) {
  for (std::size_t k = 0; k < corners.size(); ++k)
    if (turn(corners[k], corners[(k + 1) % corners.size()], p) < 0) return false;
  return corners.size() >= 3;
}

ViewCut over_terrain_of(const Database& db, ViewCut v) {
  HeightRange all;
  for (const Grid& g : db.grids()) all.add(g.info.surface_heights());
  if (db.grids().empty()) all = {0, 0};
  v.lowest = all.lowest, v.highest = all.highest, v.far = 1;
  const Extent e = db.grids().empty() ? Extent{} : db.extent();
  for (const double x : {e.xmin, e.xmax})
    for (const double y : {e.ymin, e.ymax})
      for (const double z : {v.lowest, v.highest})
        v.far = std::max(v.far, std::hypot(x - v.eye.x, y - v.eye.y, z - v.eye.z));
  return v;
}

std::unique_ptr<CutSurface> make_surface(const ViewCut& v) { return std::make_unique<ViewSurface>(v); }

}  // namespace patchwork
