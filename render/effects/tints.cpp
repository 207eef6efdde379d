#include "render/effects/tints.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Tints>& f) {
  f.choice("ramp", &Tints::ramp, {"land", "viridis", "cividis", "grey"}, "the colours, lowest to highest");
  f.number("lowest", &Tints::lowest, {}, "height of the first colour, metres; without: the terrain's lowest");
  f.number("highest", &Tints::highest, {},
           "height of the last colour, metres; without: the terrain's highest");
}

}  // namespace patchwork::effects
