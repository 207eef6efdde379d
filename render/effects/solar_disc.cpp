#include "render/effects/solar_disc.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<SolarDisc>& f) {
  f.number("diameter", &SolarDisc::diameter, between(0.01, 30), "degrees");
  f.number("glow", &SolarDisc::glow, between(0, 1), "brightness of the air around it");
}

glm::dvec3 direction_of(const Sun& sun) {
  const double a = sun.azimuth * kDegree, e = sun.elevation * kDegree;
  return {std::sin(a) * std::cos(e), std::cos(a) * std::cos(e), std::sin(e)};
}

bool in_view(const SolarDisc& disc, const Sun& sun, const Camera& camera) {
  const double corner = std::acos(axial_share(camera, 0, 0));
  const double reach = std::max(kGlowDegrees, disc.diameter) * kDegree;
  const double away = std::acos(std::clamp(glm::dot(axes(camera).forward, direction_of(sun)), -1.0, 1.0));
  return away < corner + reach;
}

}  // namespace patchwork::effects
