// The patches of an extraction as they lie in the domain, and which of them may reach a quadrangle.
#pragma once

#include <vector>

#include "blend/blend.h"

namespace patchwork {

/// A patch of an extraction, ready to be asked whether it reaches a point.
struct Blend::Placed {
  PatchId id;
  // Window coordinates (patch_surface.h): u = ua (x - x0) + ub (y - y0) - first_i, v alike.
  double x0, y0, ua, ub, va, vb, first_i, first_j;
  LatticeRect kernel, domain;  // window coordinates
  LatticeRect samples;         // where the outer samples lie; beyond them the bound grows by `rim`
  LatticeRect ramp;  // the domain, but not beyond the samples: there the patch speaks if nothing else does
  double rim;        // metres
  double error;      // metres, for the blend's smoothness
  double volume;     // 1 / (half sides of the domain in metres): makes Wendland weights of unit volume
  double quantum, base, origin;  // height = quantum (origin + code) + base
  std::int32_t source;           // 1 + place of the grid
  bool ragged;                   // has cells without data
  bool has_rim;                  // the ramp is not the domain
  Extent bounds;

  LatticeRect window_bounds(const Corners& corners) const;
  // No point of the kernel lies beyond the outer samples, whatever the rounding.
  bool kernel_is_sampled() const {
    return kernel.i0 > samples.i0 && kernel.j0 > samples.j0 && kernel.i1 < samples.i1 &&
           kernel.j1 < samples.j1;
  }
};

/// The errors are those of `smoothness`.
Blend::Placed place(const Database& db, PatchId id, int smoothness);

/// Places in a list of patches, ascending.
using Candidates = std::vector<std::uint32_t>;

/// The patches among `from` that may reach a quadrangle, in order. With priority none after one whose kernel
/// holds it all; `inside` tells that this one is the first.
Candidates filter(const std::vector<Blend::Placed>& placed, const Candidates& from, const Corners& corners,
                  bool priority, bool& inside);

}  // namespace patchwork
