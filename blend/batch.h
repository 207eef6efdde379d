// A batch of neighbouring points on its way through the patches that may reach it (used by blend.cpp).
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
  double rim;                  // metres
  double error;                // metres, for the blend's smoothness
  double volume;  // 1 / (half sides of the domain in metres): makes Wendland weights of unit volume
  double quantum, base, origin;  // height = quantum (origin + code) + base
  std::int32_t source;           // 1 + place of the grid
  bool ragged;                   // has cells without data
  Extent bounds;

  LatticeRect window_bounds(const Point corners[4]) const;
};

/// Scratch and accumulators of one batch; reused by a thread.
class Batch {
 public:
  static constexpr int kPoints = 1024;

  /// Where the points of the batch go; at most kPoints.
  std::vector<double> x, y;

  /// Composes `candidates` (places in `placed`, in order of priority) at the points.
  /// `inside`: with priority, the first candidate's kernel is known to contain all points, and it has no
  /// holes.
  void compose(const Database& db, const std::vector<Blend::Placed>& placed,
               const std::vector<std::uint32_t>& candidates, bool inside, const BlendOptions& options);

  std::vector<double> height, bound;
  std::vector<std::int32_t> source, patch;
  BlendCounts counts;

 private:
  void reset(std::size_t n);
  bool select(const Blend::Placed& p, const BlendOptions& options);
  void fade_at_holes(const PatchSurface::Holes& holes, int smoothness);
  void read(const Blend::Placed& p, const PatchSurface& s, int smoothness);
  void add(const Blend::Placed& p, std::uint32_t place, const PatchSurface& s, bool priority);
  void finish(const BlendOptions& options);

  std::vector<double> u_, v_, weight_, value_;          // of the points that the current patch reaches
  std::vector<std::uint32_t> at_;                       // which points these are
  std::vector<double> rest_, sum_, low_, high_, most_;  // of all points
  std::vector<std::uint32_t> reads_;
};

}  // namespace patchwork
