// Where a grid's samples lie in the domain: an exact affine map between lattice and plane.
#pragma once

#include <array>
#include <string>

namespace patchwork {

/// A point of the domain, metres.
struct Point {
  double x = 0, y = 0;
};

/// An upright rectangle of the domain, metres.
struct Extent {
  double xmin = 0, ymin = 0, xmax = 0, ymax = 0;
  bool contains(Point p) const { return p.x >= xmin && p.x <= xmax && p.y >= ymin && p.y <= ymax; }
  bool meets(const Extent& o) const {
    return xmin <= o.xmax && o.xmin <= xmax && ymin <= o.ymax && o.ymin <= ymax;
  }
};

/// A rectangle in lattice coordinates of one grid (level-0 cells; vertex (i, j) lies at (i, j)).
struct LatticeRect {
  double i0 = 0, j0 = 0, i1 = 0, j1 = 0;
  bool empty() const { return !(i0 < i1 && j0 < j1); }
};

/// Vertex (i, j) lies at (x0 + xi i + xj j, y0 + yi i + yj j), in exact arithmetic on the stored doubles
/// (design: model, section 2). The axes are orthogonal; they may be rotated, mirrored and of different steps.
class Frame {
 public:
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
  double cell_area() const;      ///< square metres
  double angle_degrees() const;  ///< of the i axis against the domain's x axis
  /// The upright bounds of a lattice rectangle, rounding allowed for.
  Extent bounds(const LatticeRect& r) const;

 private:
  explicit Frame(const std::array<double, 6>& n);
  std::array<double, 6> n_{0, 1, 0, 0, 0, 1};
  std::array<double, 4> inverse_{1, 0, 0, 1};
};

}  // namespace patchwork
