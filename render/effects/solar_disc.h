// The sun itself, in the sky.
#pragma once

#include "render/camera.h"
#include "render/effects/sun.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct SolarDisc {
  double diameter = 0.533;  ///< degrees
  double glow = 0.3;        ///< brightness of the air around it
};
void describe(Fields<SolarDisc>& fields);

inline constexpr double kGlowDegrees = 12;  ///< where the glow ends
/// Unit, towards the sun.
glm::dvec3 direction_of(const Sun& sun);
/// Can the disc or its glow be in the picture?
bool in_view(const SolarDisc& disc, const Sun& sun, const Camera& camera);

}  // namespace effects
}  // namespace patchwork
