#include "render/effects/sun.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Sun>& f) {
  f.number("azimuth", &Sun::azimuth, between(0, 360), "where the sun stands, degrees clockwise from north");
  f.number("elevation", &Sun::elevation, between(-90, 90), "of the sun above the horizon, degrees");
  f.number("strength", &Sun::strength, between(0, 10), "of its light on ground that faces it");
  f.number("ambient", &Sun::ambient, between(0, 1), "light that comes from everywhere");
  f.color("color", &Sun::color, "of the light");
}

}  // namespace patchwork::effects
