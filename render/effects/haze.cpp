#include "render/effects/haze.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Haze>& f) {
  f.number("visibility", &Haze::visibility, above(0), "metres at which 2 % of the contrast is left");
  f.number("base", &Haze::base, between(-12000, 100000), "height where that holds, metres");
  f.number("scale_height", &Haze::scale_height, above(0), "metres over which the air thins to 1/e");
  f.color("color", &Haze::color, "of the air");
}

}  // namespace patchwork::effects
