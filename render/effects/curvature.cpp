#include "render/effects/curvature.h"

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Curvature>& f) {
  f.number("refraction", &Curvature::refraction, between(-1, 0.9),
           "k: how much a ray is bent, as a part of the earth's curvature");
  f.number("radius", &Curvature::radius, above(0), "of the earth, metres");
}

// A small angle takes the more pixels the farther it is from the line of sight: gamma / cos^2.
double most_shift(const Curvature& c, const Camera& camera, double distance) {
  const double corner = axial_share(camera, 0, 0);
  return camera.gamma() / (corner * corner) * drop_per_square(c) * distance;
}

}  // namespace patchwork::effects
