#include "render/effects/contours.h"

#include <cmath>

#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Contours>& f) {
  f.number("interval", &Contours::interval, above(0), "between two lines, metres").required();
  f.integer("index", &Contours::index, between(0, 1000), "every so many lines one is bold; 0: none");
  f.number("width", &Contours::width, between(0.1, 20), "pixels; bold lines are twice as wide");
  f.color("color", &Contours::color, "of the lines");
  f.number("opacity", &Contours::opacity, between(0, 1), "of the lines");
}

bool can_matter(const Contours& c, double lowest, double highest) {
  const double reach = 0.25 * c.interval;
  return std::floor((highest + reach) / c.interval) * c.interval >= lowest - reach;
}

}  // namespace patchwork::effects
