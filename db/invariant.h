// Up to which error each patch is needed, and where it is the best there is: the same for every order of
// insertion.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "db/coverage.h"
#include "db/grid.h"

namespace patchwork {

/// A patch of a set of grids, by place: grids[grid].patches[index].
struct PatchPlace {
  std::size_t grid = 0, index = 0;
};

/// The strict total order on patches (design: model, section 3): kernel area, then bottom (the larger is
/// less), then the content key: digest, level, block.
bool less(const Grid& a, std::size_t ia, const Grid& b, std::size_t ib, CoverageCounts& counts);

/// What the invariant says of one patch.
struct Standing {
  double top;  ///< min { z : kernel covered by greater patches with bottom <= z }; infinity if there is none
  bool best;   ///< its kernel is not covered by patches with a smaller bottom (ties by the order)
  bool operator==(const Standing&) const = default;
};

/// Evaluates the formulas of the model for one patch against all of `grids`; reads shapes, bottoms and offers
/// and never another patch's top, so the answer depends on the set alone. Safe for concurrent use with a
/// `counts` a thread.
Standing standing(std::span<const Grid> grids, PatchPlace place, CoverageCounts& counts);

}  // namespace patchwork
