#include "render/effects/solar_disc.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<SolarDisc>& f) {
  f.number("diameter", &SolarDisc::diameter, between(0.01, 30), "degrees");
  f.number("glow", &SolarDisc::glow, between(0, 1), "brightness of the air around it");
}

}  // namespace patchwork::effects
