#include "render/effects/shadow.h"

#include <cmath>

#include "render/camera.h"
#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Shadow>& f) {
  f.number("softness", &Shadow::softness, between(0, 20), "angle over which an edge fades, degrees");
  f.number("strength", &Shadow::strength, between(0, 1), "1: no sun light at all in the shadow");
}

// Below it the sun's whole disc is hidden by a level horizon.
bool can_matter(const Shadow& shadow, const Sun& sun, double steepest) {
  const double half = 0.5 * shadow.softness;
  return sun.elevation > -half && std::tan((sun.elevation - half) * kDegree) < steepest;
}

}  // namespace patchwork::effects
