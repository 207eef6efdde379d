// How much a patch says at a point: ramps of order k for the priority blend, Wendland's function for the
// weighted one.
#pragma once

#include <algorithm>
#include <cmath>

namespace patchwork {

/// Rises from 0 at t <= 0 to 1 at t >= 1 with k continuous derivatives. k = 0, 1, 2.
template <int k>
constexpr double smoothstep(double t) {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  if constexpr (k == 0) return t;
  if constexpr (k == 1) return t * t * (3 - 2 * t);
  return t * t * t * (10 + t * (6 * t - 15));
}

/// Wendland's compactly supported functions (Patchwork Terrains, sections 3.2 and 4.1): 1 at 0, 0 from |t| =
/// 1 on; C^0 for k = 0, C^2 for k = 1, 2.
template <int k>
constexpr double wendland(double t) {
  const double r = 1 - (t < 0 ? -t : t), s = r < 0 ? 0 : r;
  if constexpr (k == 0) return s;
  return s * s * s * (4 - 3 * s);
}

/// The uniform cubic B-spline of four coefficients at t in [0, 1]: C^2, and 0 where all four are 0.
constexpr double cubic_bspline(double a, double b, double c, double d, double t) {
  const double u = 1 - t;
  return (u * u * u * a + (4 + t * t * (3 * t - 6)) * b + (4 + u * u * (3 * u - 6)) * c + t * t * t * d) / 6;
}

/// What every answering cell adds to its weight, so that the rim of the data speaks, and a filled cell where
/// nothing else does (design: model, section 2): this part of what the weight is without holes and rims, so
/// that patches of several levels stay continuous there, and kRimFloor where that is 0 too.
inline constexpr double kWeightFloor = 0x1p-60, kRimFloor = 0x1p-900;

}  // namespace patchwork
