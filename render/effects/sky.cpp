#include "render/effects/sky.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Sky>& f) {
  f.integer("directions", &Sky::directions, between(4, 32), "in which each place looks for the sky");
  f.number("strength", &Sky::strength, between(0, 1),
           "1: ground that sees no sky gets none of the light from everywhere");
  f.color("color", &Sky::color, "of the light");
}

}  // namespace patchwork::effects
