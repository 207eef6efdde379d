// Earth curvature and refraction: far ground sinks.
#pragma once

#include "render/camera.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Curvature {
  double refraction = 0.13;  ///< k: a ray's curvature as a part of the earth's
  double radius = 6371000;   ///< metres
};
void describe(Fields<Curvature>& fields);

/// Of the parabola of the earth's circle and the ray's: 1/metre.
inline double drop_per_square(const Curvature& c) { return (1 - c.refraction) / (2 * c.radius); }
/// Metres by which ground seems to sink at `distance` metres in the plane.
inline double drop(const Curvature& c, double distance) { return drop_per_square(c) * distance * distance; }

/// Pixels by which ground at `distance` metres moves on the screen at most, anywhere in the picture.
double most_shift(const Curvature& c, const Camera& camera, double distance);
/// What the scene gate neglects, pixels: a shift that no error of the surface notices.
inline constexpr double kLeastShift = 0.02;

}  // namespace effects
}  // namespace patchwork
