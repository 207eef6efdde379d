// What a camera sees of boxes, and how large a vertical error in them is on the screen.
#pragma once

#include <array>
#include <limits>

#include "db/frame.h"
#include "render/camera.h"

namespace patchwork {

/// An upright box of space, metres.
struct Box3 {
  Extent place;
  double lowest = 0, highest = 0;
};

class Frustum {
 public:
  /// `curvature`: metres by which the earth drops away, per square metre of distance in the plane.
  /// `far`: metres along the view's axis; boxes beyond are not seen.
  explicit Frustum(const Camera& camera, double curvature = 0,
                   double far = std::numeric_limits<double>::infinity());
  /// False only if no point of the box is on the screen.
  bool sees(const Box3& box) const;
  /// Pixels a metre of vertical displacement takes anywhere in the box, never too few; infinity where the
  /// box reaches the eye's plane. With the depth along the view's axis, because a pixel at the picture's edge
  /// is farther away than the one in its middle at the same depth.
  double pixels_per_metre(const Box3& box) const;
  /// Inward normals of the four sides (through the eye), and the view's axis.
  const std::array<std::array<double, 3>, 4>& sides() const { return sides_; }
  const std::array<double, 3>& axis() const { return axis_; }

 private:
  Box3 bent(const Box3& box) const;
  double stretch_in(const Box3& bent) const;
  Point3 eye_;
  double curvature_, far_, gamma_, wide_, high_;  // tangents of half the picture
  std::array<double, 3> axis_, right_, up_;
  std::array<std::array<double, 3>, 4> sides_;
};

}  // namespace patchwork
