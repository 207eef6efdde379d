#include "render/effects/overlays.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<ErrorOverlay>& f) {
  f.number("lowest", &ErrorOverlay::lowest, above(0),
           "bound of the first colour, metres; without: in view, of a film in its first picture of ground");
  f.number("highest", &ErrorOverlay::highest, above(0),
           "bound of the last colour, metres; without: in view, of a film in its first picture of ground");
  f.flag("logarithmic", &ErrorOverlay::logarithmic,
         "a logarithmic scale; without: where the skewness of the bounds is above 1");
  f.number("opacity", &ErrorOverlay::opacity, between(0, 1), "over the ground's own colour");
}

void describe(Fields<SourceOverlay>& f) {
  f.number("opacity", &SourceOverlay::opacity, between(0, 1), "over the ground's own colour");
}

void describe(Fields<CostOverlay>& f) {
  f.number("highest", &CostOverlay::highest, at_least(2), "patches at the last colour");
  f.number("opacity", &CostOverlay::opacity, between(0, 1), "over the ground's own colour");
}

void describe(Fields<Wireframe>& f) {
  f.color("color", &Wireframe::color, "of the lines");
  f.number("opacity", &Wireframe::opacity, between(0, 1), "of the lines");
}

}  // namespace patchwork::effects
