// The camera's way through a flight's points, at constant speed over ground.
#pragma once

#include <vector>

#include "render/camera.h"
#include "render/clothoid.h"
#include "render/scene.h"

namespace patchwork {

/// In the plane a chain of clothoids (heading and curvature are continuous); heights between points neither
/// overshoot nor kink (monotone cubics over the length of the way).
class CameraPath {
 public:
  /// Throws Error: points through which no smooth way leads, more than Flight::kMostFrames.
  explicit CameraPath(const Flight& flight);

  double length() const { return knots_.back(); }  ///< metres over ground
  /// So many frames as the flight asks for, or as its speed makes; at least 1.
  int frames() const;
  /// Metres over ground from the first point to frame k.
  double distance_of(int frame) const;
  Camera frame(int k, int width, int height) const { return at(distance_of(k), width, height); }

  /// The eye `s` metres over ground from the first point; beyond the ends the way goes on straight and level.
  Point3 eye(double s) const;
  double heading(double s) const;    ///< radians, counterclockwise from east
  double curvature(double s) const;  ///< 1 / metres
  /// Looks at the flight's target, or, without one, towards where the way leads look_ahead metres ahead.
  Camera at(double s, int width, int height) const;

 private:
  struct Along {  // s clamped to the arc, the arc, and how far s lies beyond the way
    const Clothoid& arc;
    double s, beyond;
  };
  Along along(double s) const;
  Point3 target(double s) const;

  Flight flight_;
  std::vector<Clothoid> arcs_;
  std::vector<double> knots_;  // metres over ground at the points
};

}  // namespace patchwork
