// Where a grid's samples lie in the domain: an exact affine map between lattice and plane.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>

namespace patchwork {

/// A point of the domain, metres.
struct Point {
  double x = 0, y = 0;
};

using Corners = std::array<Point, 4>;  ///< of a rectangle, in turn

/// Twice the area of the triangle: above 0 where a, b, c turn left.
inline double turn(Point a, Point b, Point c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// An upright rectangle of the domain, metres.
struct Extent {
  double xmin = 0, ymin = 0, xmax = 0, ymax = 0;
  /// Holds no point; what is added to it first is all of it.
  static constexpr Extent nothing() {
    constexpr double k = std::numeric_limits<double>::infinity();
    return {k, k, -k, -k};
  }
  bool contains(Point p) const { return p.x >= xmin && p.x <= xmax && p.y >= ymin && p.y <= ymax; }
  bool meets(const Extent& o) const {
    return xmin <= o.xmax && o.xmin <= xmax && ymin <= o.ymax && o.ymin <= ymax;
  }
  void add(Point p) {
    xmin = std::min(xmin, p.x), ymin = std::min(ymin, p.y);
    xmax = std::max(xmax, p.x), ymax = std::max(ymax, p.y);
  }
  void add(const Extent& e) {
    xmin = std::min(xmin, e.xmin), ymin = std::min(ymin, e.ymin);
    xmax = std::max(xmax, e.xmax), ymax = std::max(ymax, e.ymax);
  }
  /// What both hold; xmin > xmax or ymin > ymax where that is nothing.
  Extent common(const Extent& o) const {
    return {std::max(xmin, o.xmin), std::max(ymin, o.ymin), std::min(xmax, o.xmax), std::min(ymax, o.ymax)};
  }
  /// In turn: (xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax).
  Corners corners() const { return {{{xmin, ymin}, {xmax, ymin}, {xmax, ymax}, {xmin, ymax}}}; }
};

/// A rectangle in lattice coordinates of one grid (level-0 cells; vertex (i, j) lies at (i, j)).
struct LatticeRect {
  double i0 = 0, j0 = 0, i1 = 0, j1 = 0;
  /// Holds no point; what is added to it first is all of it.
  static constexpr LatticeRect nothing() {
    constexpr double k = std::numeric_limits<double>::infinity();
    return {k, k, -k, -k};
  }
  bool empty() const { return !(i0 < i1 && j0 < j1); }
  /// In level-0 cells; exact for kernels: a product of dyadic numbers of a few bits.
  double area() const { return (i1 - i0) * (j1 - j0); }
  void add(Point p) {
    i0 = std::min(i0, p.x), j0 = std::min(j0, p.y);
    i1 = std::max(i1, p.x), j1 = std::max(j1, p.y);
  }
};

/// Vertex (i, j) lies at (x0 + xi i + xj j, y0 + yi i + yj j), in exact arithmetic on the stored doubles
/// (design: model, section 2). The axes are orthogonal, to a cosine of kMostShear; they may be rotated,
/// mirrored and of different steps.
class Frame {
 public:
  /// Axes further from orthogonal than this (cosine) are shear, not the rounding of a printed rotation.
  static constexpr double kMostShear = 1e-5;

  Frame() = default;

  /// From a GDAL geotransform (pixel corner); the frame's lattice is that of the pixel centres.
  /// `where` names the source in the message. Throws Error: not finite, not invertible, sheared.
  static Frame from_geotransform(const std::array<double, 6>& gt, const std::string& where);
  /// The six numbers {x0, xi, xj, y0, yi, yj} as `numbers()` gave them out; not validated.
  static Frame from_trusted(const std::array<double, 6>& n) { return Frame(n); }

  const std::array<double, 6>& numbers() const { return n_; }
  Point to_domain(double i, double j) const {
    return {n_[0] + (n_[1] * i + n_[2] * j), n_[3] + (n_[4] * i + n_[5] * j)};
  }
  /// Lattice coordinates {i, j} of a point of the domain.
  Point to_lattice(double x, double y) const {
    const double dx = x - n_[0], dy = y - n_[3];
    return {inverse_[0] * dx + inverse_[1] * dy, inverse_[2] * dx + inverse_[3] * dy};
  }
  /// Rows of the inverse matrix: i = inverse[0] dx + inverse[1] dy, j = inverse[2] dx + inverse[3] dy.
  const std::array<double, 4>& inverse() const { return inverse_; }
  double step_i() const;         ///< metres between (0,0) and (1,0)
  double step_j() const;         ///< metres between (0,0) and (0,1)
  double finer_step() const;     ///< the smaller of the two
  double cell_area() const;      ///< square metres
  double cosine() const;         ///< of the angle between the axes
  double angle_degrees() const;  ///< of the i axis against the domain's x axis
  /// The corners of a lattice rectangle in the domain, in turn: (i0, j0), (i1, j0), (i1, j1), (i0, j1).
  Corners corners(const LatticeRect& r) const {
    return {to_domain(r.i0, r.j0), to_domain(r.i1, r.j0), to_domain(r.i1, r.j1), to_domain(r.i0, r.j1)};
  }
  /// The smallest lattice rectangle that holds points of the domain, not rounded outward.
  LatticeRect lattice_bounds(std::span<const Point> points) const {
    LatticeRect r = LatticeRect::nothing();
    for (const Point p : points) r.add(to_lattice(p.x, p.y));
    return r;
  }
  /// The upright bounds of a lattice rectangle, rounding allowed for.
  Extent bounds(const LatticeRect& r) const;

 private:
  explicit Frame(const std::array<double, 6>& n);
  std::array<double, 6> n_{0, 1, 0, 0, 0, 1};
  std::array<double, 4> inverse_{1, 0, 0, 1};
};

}  // namespace patchwork
