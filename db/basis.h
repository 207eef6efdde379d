// The interpolants of a patch along one axis: what a cell makes of the four samples around it.
#pragma once

namespace patchwork {

/// Weights of the samples before the cell, at its far end and beyond, each against the sample at the near
/// end: p(t) = p1 + before (p0 - p1) + far (p2 - p1) + beyond (p3 - p1), t in [0, 1]. Exact at t = 0, and for
/// constants.
struct CellWeights {
  double before = 0, far = 0, beyond = 0;
};

/// Smoothness k = 0: linear. k = 1: cubic Hermite with central differences. k = 2: quintic Hermite with
/// central first and second differences, which is C^2, interpolates, and reads no further than k = 1: a C^2
/// *cubic* with these properties does not exist (its support is the whole lattice), and with it neighbouring
/// patches of a level could not agree in their overlap to the last bit.
template <int k>
constexpr CellWeights cell_weights(double t) {
  if constexpr (k == 0) {
    return {0, t, 0};
  } else {
    const double u = 1 - t;
    double before, beyond;
    if constexpr (k == 1) {  // from p'(0) = (p2 - p0) / 2, p'(1) = (p3 - p1) / 2
      before = -0.5 * t * (u * u), beyond = -0.5 * u * (t * t);
    } else {  // from the same slopes and p''(0) = p0 - 2 p1 + p2, p''(1) = p1 - 2 p2 + p3
      before = t * (-0.5 + t * (0.5 + t * (1.5 + t * (-2.5 + t))));
      beyond = u * (-0.5 + u * (0.5 + u * (1.5 + u * (-2.5 + u))));
    }
    // Linear data are reproduced, so the first moment gives the last weight: -before + far + 2 beyond = t.
    return {before, t + before - 2 * beyond, beyond};
  }
}

/// No interpolant above departs from the linear one by more than this times the largest second difference of
/// the samples it reads, along one axis (t (1 - t) / 2 at most; before and beyond never change sign).
inline constexpr double kDepartureFromLinear = 1.0 / 8;
/// Sums of the absolute weights of the two inner samples and of the two outer ones, at most (reached at t =
/// 1/2).
inline constexpr double kInnerWeights = 1.125, kOuterWeights = 0.125;
/// |p''(t)| <= this times the largest second difference (cubic 3, quintic 2.53).
inline constexpr double kSecondDerivative = 3.0;

}  // namespace patchwork
