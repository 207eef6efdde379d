// Doubles as floats that do not lie on the wrong side of them.
#pragma once

#include <cmath>
#include <limits>

namespace patchwork {

/// The largest float that is not above v.
inline float float_at_most(double v) {
  const auto f = float(v);
  return double(f) > v ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
/// The smallest float that is not below v.
inline float float_at_least(double v) {
  const auto f = float(v);
  return double(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace patchwork
