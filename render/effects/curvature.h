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

}  // namespace effects
}  // namespace patchwork
