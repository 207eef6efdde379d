#include "render/effects/sky.h"

#include <cmath>

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Sky>& f) {
  f.integer("directions", &Sky::directions, between(4, 32), "in which each place looks for the sky");
  f.number("strength", &Sky::strength, between(0, 1),
           "1: ground that sees no sky gets none of the light from everywhere");
  f.color("color", &Sky::color, "of the light");
}

double lowest_direction(const Sky& sky) {
  const double r2 = (sky.directions - 0.5) / sky.directions;
  return std::sqrt((1 - r2) / r2);
}

bool can_matter(const Sky& sky, double steepest) { return steepest > lowest_direction(sky); }

}  // namespace patchwork::effects
