// The inner loops of the blend on the CPU: arrays in, arrays out, compiled for every vector width.
#pragma once

#include "db/frame.h"
#include "db/patch_surface.h"

namespace patchwork::kernels {

/// The affine map of a patch (Blend::Placed).
struct WindowMap {
  double x0, y0, ua, ub, va, vb, first_i, first_j;
};

/// Window coordinates of n points.
void to_window(const WindowMap& m, const double* x, const double* y, int n, double* u, double* v);

/// Weight of a rectangle at window coordinates: ramps from 0 at the rim of `ramp` to 1 on `kernel`
/// (priority), or Wendland's function of the distance from the domain's centre; -1 outside the closed domain.
/// REQUIRES: kernel inside ramp (no shared edge), ramp inside domain.
void ramp_weights(int smoothness, const LatticeRect& kernel, const LatticeRect& ramp,
                  const LatticeRect& domain, const double* u, const double* v, int n, double* weight);
void wendland_weights(int smoothness, const LatticeRect& domain, const double* u, const double* v, int n,
                      double* weight);

/// Codes of a patch at window coordinates inside its domain.
void interpolate(int smoothness, const float* codes, const double* u, const double* v, int n, double* value);

}  // namespace patchwork::kernels
