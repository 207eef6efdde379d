#include "render/effects/curvature.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Curvature>& f) {
  f.number("refraction", &Curvature::refraction, between(-1, 0.9),
           "k: how much a ray is bent, as a part of the earth's curvature");
  f.number("radius", &Curvature::radius, above(0), "of the earth, metres");
}

}  // namespace patchwork::effects
