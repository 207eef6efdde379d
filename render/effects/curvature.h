// Earth curvature and refraction: far ground sinks.
#pragma once

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Curvature {
  double refraction = 0.13;  ///< k: a ray's curvature as a part of the earth's
  double radius = 6371000;   ///< metres
};
void describe(Fields<Curvature>& fields);

/// Metres by which ground seems to sink at `distance` metres in the plane: the parabola of the earth's circle
/// and the ray's.
inline double drop(const Curvature& c, double distance) {
  return distance * distance * (1 - c.refraction) / (2 * c.radius);
}

}  // namespace effects
}  // namespace patchwork
