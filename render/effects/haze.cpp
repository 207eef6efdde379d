#include "render/effects/haze.h"

#include <algorithm>
#include <cmath>

#include "render/color.h"
#include "render/fields.h"

namespace patchwork::effects {

void describe(Fields<Haze>& f) {
  f.number("visibility", &Haze::visibility, above(0), "metres at which 2 % of the contrast is left");
  f.number("base", &Haze::base, between(-12000, 100000), "height where that holds, metres");
  f.number("scale_height", &Haze::scale_height, above(0), "metres over which the air thins to 1/e");
  f.color("color", &Haze::color, "of the air");
}

// Koschmieder: contrast falls to 2 % at an optical depth of 3.912.
double depth_per_metre(const Haze& haze, double height) {
  return 3.912 / haze.visibility * std::exp((haze.base - height) / haze.scale_height);
}

// A channel c becomes (1 - d) c + d a. sRGB's curve s is concave with s(0) = 0, so it rises by at most s(d
// a); it falls by at most max of c s'(c) = 0.44 times d / (1 - d).
double most_change(const Haze& haze, double farthest, double lowest) {
  constexpr double kBlue = 1.2;  // haze.glsl: transmittance
  const double d = 1 - std::exp(-kBlue * depth_per_metre(haze, lowest) * farthest);
  const double air = std::max({linear_of(haze.color.r), linear_of(haze.color.g), linear_of(haze.color.b)});
  const double lit = d * air;
  const double rise = lit <= 0.0031308 ? 12.92 * lit : 1.055 * std::pow(lit, 1 / 2.4) - 0.055;
  return std::max(rise, d < 1 ? 0.44 * d / (1 - d) : 1);
}

}  // namespace patchwork::effects
