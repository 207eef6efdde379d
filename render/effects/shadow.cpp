#include "render/effects/shadow.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Shadow>& f) {
  f.number("softness", &Shadow::softness, between(0, 20), "angle over which an edge fades, degrees");
  f.number("strength", &Shadow::strength, between(0, 1), "1: no sun light at all in the shadow");
}

}  // namespace patchwork::effects
