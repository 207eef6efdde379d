#include "query/cut.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "db/error.h"
#include "db/vectorized.h"
#include "query/ranged_surface.h"

namespace patchwork {

namespace {

class UniformSurface : public CutSurface {
 public:
  explicit UniformSurface(const UniformCut& cut) : cut_(cut), limit_(float_at_most(cut.error)) {}
  double at(Point) const override { return cut_.error; }
  ToleranceRange over(const Frame&, const LatticeRect&) const override { return {cut_.error, cut_.error}; }
  bool meets(const Grid& g, const GridShape::Block& b) const override { return cut_.region.meets(g, b); }
  LodHits hits(const LodPage& page, bool inside) const override {
    return page.uniform_hits(cut_.region.bounds(), limit_, inside);
  }

 private:
  UniformCut cut_;
  float limit_;
};

using Vector = std::array<double, 3>;
Vector operator+(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vector operator*(double s, const Vector& a) { return {s * a[0], s * a[1], s * a[2]}; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector normalised(const Vector& a) { return (1 / std::hypot(a[0], a[1], a[2])) * a; }

// Andrew's monotone chain (1979).
std::vector<Point> convex_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
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

// The sides of a convex region, eight to a vector: inside are the points with nx x + ny y <= most. What is
// positive of a normal stands apart from what is negative, so that a box's innermost and outermost corner
// need no choice. Those that are there to fill a vector hold every point.
struct EightSides {
  static constexpr std::size_t kSides = 8;

  double nx_up[kSides] = {}, nx_down[kSides] = {}, ny_up[kSides] = {}, ny_down[kSides] = {};
  double most[kSides], nearly[kSides];  // nearly: with a hair of slack

  EightSides() { std::fill_n(most, kSides, INFINITY), std::fill_n(nearly, kSides, INFINITY); }
  void set(std::size_t i, double nx, double ny, double limit);
  bool beyond(std::size_t i, Point p) const {
    return (nx_up[i] + nx_down[i]) * p.x + (ny_up[i] + ny_down[i]) * p.y > most[i];
  }
};

// A hair of slack makes up for the rounding of squares, which stand for roots.
constexpr double kHair = 1e-9;

double lesser(double a, double b) { return a < b ? a : b; }
double greater(double a, double b) { return a > b ? a : b; }

// Boxes that meet `bounds` and whose errors meet k times the squared distance from the eye, which is
// `height` above the plane. Each condition is an amount that must not be negative, so that the least of them
// decides; all slots are compared, in use or not: loops of fixed length become vectors.
PATCHWORK_VECTORIZED void near_enough(const LodPage& page, Point eye, double height, double k, Extent bounds,
                                      std::uint8_t* __restrict hit) {
  const double h = height * height, k_far = k * (1 + kHair), k_near = k * (1 - kHair);
  double least[LodPage::kSlots];
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s) {
    const double left = page.xmin[s] - eye.x, right = eye.x - page.xmax[s];
    const double below = page.ymin[s] - eye.y, above = eye.y - page.ymax[s];
    const double fx = lesser(left, right), fy = lesser(below, above);
    const double dx = greater(greater(left, right), 0), dy = greater(greater(below, above), 0);
    const double bottom = page.bottom[s], top = page.top[s];
    const double outside = greater(greater(page.xmin[s] - bounds.xmax, bounds.xmin - page.xmax[s]),
                                   greater(page.ymin[s] - bounds.ymax, bounds.ymin - page.ymax[s]));
    least[s] = lesser(lesser(k_far * (fx * fx + fy * fy + h) - bottom * bottom,
                             top * top - k_near * (dx * dx + dy * dy + h)),
                      -outside);
  }
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s) hit[s] = std::uint8_t(least[s] >= 0);
}

void EightSides::set(std::size_t i, double nx, double ny, double limit) {
  nx_up[i] = greater(nx, 0), nx_down[i] = lesser(nx, 0);
  ny_up[i] = greater(ny, 0), ny_down[i] = lesser(ny, 0);
  most[i] = limit, nearly[i] = limit + kHair * std::abs(limit);
}

// Of the boxes that a page met those that have a corner on the inner side of each side; `inside` are those
// that have all corners there. Few are left to be asked, so a vector takes the sides of one box.
PATCHWORK_VECTORIZED void keep_inside(const LodPage& page, const std::vector<EightSides>& sides,
                                      LodHits& hits) {
  using Numbers = double __attribute__((vector_size(EightSides::kSides * sizeof(double))));
  using Bytes = std::int8_t __attribute__((vector_size(EightSides::kSides)));
  std::uint64_t out = 0, not_whole = 0;
  for (const EightSides& e : sides) {
    Numbers nx_up, nx_down, ny_up, ny_down, most, nearly;
    std::memcpy(&nx_up, e.nx_up, sizeof(Numbers)), std::memcpy(&nx_down, e.nx_down, sizeof(Numbers));
    std::memcpy(&ny_up, e.ny_up, sizeof(Numbers)), std::memcpy(&ny_down, e.ny_down, sizeof(Numbers));
    std::memcpy(&most, e.most, sizeof(Numbers)), std::memcpy(&nearly, e.nearly, sizeof(Numbers));
    for (std::uint64_t left = hits.met; left; left &= left - 1) {
      const auto s = std::uint32_t(std::countr_zero(left));
      const double x0 = page.xmin[s], y0 = page.ymin[s], x1 = page.xmax[s], y1 = page.ymax[s];
      const Bytes in =
          __builtin_convertvector((nx_up * x0 + nx_down * x1) + (ny_up * y0 + ny_down * y1) > nearly, Bytes);
      out |= std::uint64_t{std::bit_cast<std::uint64_t>(in) != 0} << s;
      if (page.level == 0) continue;  // there is nothing below it
      const Bytes at =
          __builtin_convertvector((nx_up * x1 + nx_down * x0) + (ny_up * y1 + ny_down * y0) > most, Bytes);
      not_whole |= std::uint64_t{std::bit_cast<std::uint64_t>(at) != 0} << s;
    }
  }
  hits.met &= ~out, hits.inside &= ~(out | not_whole);
}

class ViewSurface : public CutSurface {
 public:
  explicit ViewSurface(const ViewCut& cut)
      : eye_{cut.eye.x, cut.eye.y},
        above_(cut.in_space ? std::max({0.0, cut.eye.z - cut.highest, cut.lowest - cut.eye.z}) : 0),
        slope_(cut.pixel_error * 2 * std::tan(cut.fov_degrees * (M_PI / 360)) / cut.height),
        corners_(footprint(cut)) {
    for (std::size_t k = 0; corners_.size() >= 3 && k < corners_.size(); ++k) {
      const Point &a = corners_[k], &b = corners_[(k + 1) % corners_.size()];
      const double nx = b.y - a.y, ny = a.x - b.x;  // outward of a counterclockwise polygon
      if (k % EightSides::kSides == 0) sides_.emplace_back();
      sides_.back().set(k % EightSides::kSides, nx, ny, std::max(nx * a.x + ny * a.y, nx * b.x + ny * b.y));
      bounds_.add(a);
    }
  }

  double at(Point p) const override { return slope_ * std::hypot(p.x - eye_.x, p.y - eye_.y, above_); }

  // The frame's axes are orthogonal, so the nearest point of a rectangle is found axis by axis.
  ToleranceRange over(const Frame& frame, const LatticeRect& r) const override {
    const Point e = frame.to_lattice(eye_.x, eye_.y);
    const double i = frame.step_i(), j = frame.step_j();
    const auto near = [](double v, double a, double b) { return std::max({a - v, v - b, 0.0}); };
    const auto far = [](double v, double a, double b) { return std::max(std::abs(a - v), std::abs(b - v)); };
    return {slope_ * std::hypot(i * near(e.x, r.i0, r.i1), j * near(e.y, r.j0, r.j1), above_),
            slope_ * std::hypot(i * far(e.x, r.i0, r.i1), j * far(e.y, r.j0, r.j1), above_)};
  }

  // Two convex sets are apart if a side of one of them parts them.
  bool meets(const Grid& grid, const GridShape::Block& b) const override {
    if (sides_.empty()) return false;
    const LatticeRect d = grid.info.shape.domain(b.level, b.bx, b.by);
    const Frame& f = grid.info.frame;
    const Corners rect = f.corners(d);
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      const auto beyond = [&](const Point& p) {
        return sides_[k / EightSides::kSides].beyond(k % EightSides::kSides, p);
      };
      if (std::all_of(rect.begin(), rect.end(), beyond)) return false;
    }
    const LatticeRect seen = f.lattice_bounds(corners_);
    return seen.i0 <= d.i1 && d.i0 <= seen.i1 && seen.j0 <= d.j1 && d.j0 <= seen.j1;
  }

  LodHits hits(const LodPage& page, bool inside) const override {
    if (sides_.empty()) return {};
    std::uint8_t hit[LodPage::kSlots];
    near_enough(page, eye_, above_, slope_ * slope_, bounds_, hit);
    LodHits hits{page.mask_of_used(hit)};
    hits.inside = hits.met;
    if (inside) return hits;
    keep_inside(page, sides_, hits);
    return hits;
  }

 private:
  Point eye_;
  double above_;  // metres that the eye is above or below all terrain, where the cut is in space
  double slope_;  // metres of tolerance a metre of distance
  std::vector<Point> corners_;
  Extent bounds_ = Extent::nothing();  // of the corners
  std::vector<EightSides> sides_;
};

}  // namespace

std::vector<Point> footprint(const ViewCut& v) {
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
  return points.size() < 3 ? std::vector<Point>() : convex_hull(std::move(points));
}

ViewCut over_terrain_of(const Database& db, ViewCut v) {
  v.lowest = INFINITY, v.highest = -INFINITY, v.far = 1;
  for (const Grid& g : db.grids()) {
    const double rim = g.info.rim_error;  // what the half cell beyond the samples may add
    v.lowest = std::min(v.lowest, g.info.lowest - rim), v.highest = std::max(v.highest, g.info.highest + rim);
  }
  if (db.grids().empty()) v.lowest = v.highest = 0;
  const Extent e = db.grids().empty() ? Extent{} : db.extent();
  for (const double x : {e.xmin, e.xmax})
    for (const double y : {e.ymin, e.ymax})
      for (const double z : {v.lowest, v.highest})
        v.far = std::max(v.far, std::hypot(x - v.eye.x, y - v.eye.y, z - v.eye.z));
  return v;
}

std::unique_ptr<CutSurface> make_surface(const UniformCut& cut) {
  require(is_error(cut.error), "error", "it must be a number of metres, 0 or more");
  return std::make_unique<UniformSurface>(cut);
}

std::unique_ptr<CutSurface> make_surface(const ViewCut& v) {
  for (const double n : {v.eye.x, v.eye.y, v.eye.z, v.look.x, v.look.y, v.look.z, v.lowest, v.highest})
    require(std::isfinite(n), "view", "eye, look and heights must be numbers");
  require(std::hypot(v.look.x - v.eye.x, v.look.y - v.eye.y, v.look.z - v.eye.z) > 0, "view",
          "eye and look are the same point");
  require(v.fov_degrees > 0 && v.fov_degrees < 180, "fov", "it must be between 0 and 180 degrees");
  require(v.width > 0 && v.height > 0, "size", "width and height must be pixels, at least 1");
  require(is_error(v.pixel_error), "pixel-error", "it must be a number of pixels, 0 or more");
  require(v.far > 0 && std::isfinite(v.far) && v.lowest <= v.highest, "view", "it has no extent");
  return std::make_unique<ViewSurface>(v);
}

}  // namespace patchwork
