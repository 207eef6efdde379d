// Gradient noise from an integer hash: the same bits on every machine, defined over the whole plane.
#pragma once

#include <cstdint>
#include <span>

namespace patchwork {

/// Murmur3's finaliser: every bit of the result depends on every bit of `h`.
inline std::uint32_t mix(std::uint32_t h) {
  h = (h ^ h >> 16) * 0x85ebca6bu;
  h = (h ^ h >> 13) * 0xc2b2ae35u;
  return h ^ h >> 16;
}

/// What all lattice points of row j share; hashing a row point by point costs one mix each.
inline std::uint32_t row_key(std::int64_t j, std::uint32_t seed) {
  return mix(std::uint32_t(j) * 0x85ebca77u ^ mix(seed + 0x9e3779b9u));
}

/// A well-mixed 32-bit hash of a lattice point (modulo 2^32) and a seed.
inline std::uint32_t hash_lattice(std::int64_t i, std::int64_t j, std::uint32_t seed) {
  return mix(std::uint32_t(i) * 0x9e3779b1u ^ row_key(j, seed));
}

/// Uniform in [0, 1) with 32 bits.
inline double hash_unit(std::int64_t i, std::int64_t j, std::uint32_t seed) {
  return hash_lattice(i, j, seed) * 0x1p-32;
}

/// One octave, twice continuously differentiable, values in [-1, 1] (each gradient component is in [-1, 1]
/// and the blending weights sum to 1), zero at every lattice point.
struct NoiseOctave {
  double frequency = 1;  ///< 1 / metres
  std::uint32_t seed = 0;

  /// REQUIRES: |x * frequency|, |y * frequency| < 2^31 - 2; equal lengths. Consecutive points in one lattice
  /// cell share its hashes; the values do not depend on how points are grouped.
  void values(std::span<const double> x, std::span<const double> y, std::span<double> out) const;
};

}  // namespace patchwork
