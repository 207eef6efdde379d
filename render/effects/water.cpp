#include "render/effects/water.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Water>& f) {
  f.number("level", &Water::level, between(-12000, 9000), "of the water, metres").required();
  f.number("waves", &Water::waves, between(0, 20), "their height, metres; 0: a mirror");
  f.number("clarity", &Water::clarity, above(0), "metres of water through which 1/e of the light passes");
  f.color("color", &Water::color, "of deep water");
}

}  // namespace patchwork::effects
