// The largest distance of every patch from its grid's level-0 surface, for k = 0, 1, 2.
#pragma once

#include <array>
#include <mutex>
#include <span>
#include <vector>

#include "db/cell_masks.h"
#include "db/grid_shape.h"
#include "db/lattice.h"

namespace patchwork {

/// Gathers errors row by row, in any order and from any thread: maxima do not depend on either.
///
/// The reference is the level-0 *bilinear* surface for every k, so that one bound means the same whatever the
/// smoothness. For k = 0 the maximum over the level-0 vertices is exact (both surfaces are bilinear on each
/// level-0 cell). For k = 1, 2 the distance is measured at the vertices (levels 1, 2: at every half cell too)
/// and a remainder for the inside is added, cell by cell, from the second differences of the samples that the
/// cell's interpolant reads, D = kInnerWeights D_inner + kOuterWeights D_outer along each axis (constants in
/// basis.h):
///   level 0:  kDepartureFromLinear times the sum over both axes (one of them with D_inner alone);
///   level l:  kSecondDerivative (D_i + D_j) / (8 n^2), n measured positions a level cell: the error of
///   bilinear
///             interpolation between positions where the distance is known.
/// k = 1 and k = 2 share the larger of their errors.
class PatchErrors {
 public:
  /// `cells` outlives it; empty where every cell holds data. Cells that do not answer hide nothing.
  PatchErrors(const GridShape& shape, const CellMasks& cells);
  struct Positions;  ///< where along an axis errors are measured (patch_errors.cpp)

  /// Measures a level at the level-0 rows [y0, y1). `valid`: 1 where a sample of level0's rows holds data;
  /// empty if all do. `lattice` holds the level's rows floor(y0 / 2^level) - 2 .. floor((y1 - 1) / 2^level)
  /// + 2. The half cells beyond the outer samples of a pixel-is-area grid are measured with the first and the
  /// last row.
  void measure(const Lattice& lattice, const Lattice& level0, std::span<const std::uint8_t> valid, int y0,
               int y1);
  /// Errors in codes for k = 0, 1, 2; what is below 2^-30 of a code is rounding of the measurement and counts
  /// as 0.
  std::array<double, 3> of(int level, int bx, int by) const;
  /// The largest error of k = 1, 2 at level 0, codes: how far they depart from the bilinear surface.
  double largest_departure() const;

 private:
  class Strip;
  struct Largest {
    float linear = 0, smooth = 0;  // rounded up
  };
  struct Level {
    int ni, nj;                   // segments along each axis (patch_errors.cpp)
    std::vector<Largest> blocks;  // row by row: segments kept apart took nine times the memory
  };
  void note(int level, int segment, const Positions& positions, int p0, int p1, const double* linear,
            const double* smooth);
  GridShape shape_;
  const CellMasks& cells_;
  std::vector<Level> levels_;
  std::mutex mutex_;
};

}  // namespace patchwork
