// A ray as the search for what hides it sees it (used by sight*.cpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "blend/sight.h"

namespace patchwork {

/// z(t) = z0 + t dz + t^2 sag, t in [0, 1]; x and y are linear.
struct SightPath {
  double x0, y0, z0, dx, dy, dz, sag;

  SightPath(const SightRay& r, const Air& air)
      : x0(r.from.x), y0(r.from.y), z0(r.from.z), dx(r.to.x - r.from.x), dy(r.to.y - r.from.y) {
    sag = drop(ground(), air);
    dz = r.to.z - r.from.z - sag;
  }
  double x(double t) const { return x0 + t * dx; }
  double y(double t) const { return y0 + t * dy; }
  double z(double t) const { return z0 + t * (dz + t * sag); }
  double ground() const { return std::hypot(dx, dy); }
  double length() const { return std::hypot(dx, dy, std::abs(dz) + sag); }  ///< at least
  /// The smallest height between two parameters.
  double lowest(double a, double b) const {
    const double turn = sag > 0 ? std::clamp(-dz / (2 * sag), a, b) : a;
    return std::min({z(a), z(b), z(turn)});
  }
};

/// Parameters of a ray.
struct SightInterval {
  double low = 0, high = 1;
  bool empty() const { return low > high; }
  /// Keeps the part with a <= p + t d <= b.
  void clip(double p, double d, double a, double b) {
    if (d == 0) {
      if (p < a || p > b) high = -1;
      return;
    }
    const double s = (a - p) / d, e = (b - p) / d;
    low = std::max(low, std::min(s, e)), high = std::min(high, std::max(s, e));
  }
};

/// What a place of a ray is to the surface along it.
enum class SightPlace : std::uint8_t {
  begins,    ///< a line as below; what lies between it and the place before need not be looked at
  line,      ///< here the surface may change its shape
  parabola,  ///< between two lines, where the surface is a parabola
  curve      ///< between two lines, where it is smooth
};

/// What is known of the surface there, metres.
struct SightSample {
  double t, above, bound;  ///< `above`: how far the surface is above the ray; NaN where there is no data
  SightPlace place;
};

}  // namespace patchwork
