// The extraction: which patches a cut needs, in the order in which they speak, and what finding them cost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "db/database.h"
#include "query/cut.h"

namespace patchwork {

struct Cost {
  std::size_t nodes = 0, boxes = 0;  ///< of the R-tree: pages read, boxes compared
  std::size_t patches = 0;
  std::size_t bytes = 0;  ///< of the patches' samples in memory
  double seconds = 0;
};

struct Extraction {
  std::vector<PatchId> patches;  ///< by bottom, then by the order of the model (the greater first)
  Cost cost;
  double bound_max = 0;  ///< metres: the largest that they give (k = 0), half cells beyond samples included
  double bound_inside = 0;     ///< the same without these
  double error_available = 0;  ///< metres: the smallest bottom among them
};

/// `strict`: only patches whose bottom the tolerance allows somewhere; else, where that is not available, the
/// best there is.
Extraction extract(const Database& db, const CutSurface& cut, bool strict = false);
/// Throw Error for cuts that are none (see make_surface).
Extraction extract(const Database& db, const UniformCut& cut);
template <class Cut>  // ViewCut, CorridorCut, FieldCut; a template, so that braces mean a uniform cut
requires requires(const Cut& cut) { make_surface(cut), cut.strict; }
Extraction extract(const Database& db, const Cut& cut) { return extract(db, *make_surface(cut), cut.strict); }

/// The finest patches of some grids alone, whether others hide them or not: with the priority blend the
/// surface of these surveys, as if there were no other. Looks at every block of theirs.
Extraction extract_grids(const Database& db, std::span<const GridId> grids, const Region& region = {});

/// What a client that holds the patches of `before` must get and may drop, each by id.
struct Difference {
  std::vector<PatchId> add, drop;
};
Difference difference(const Extraction& now, const Extraction& before);

/// The smallest error, or pixel error, whose answer keeps to the budget.
struct Budget {
  std::size_t patches = SIZE_MAX, bytes = SIZE_MAX;  ///< bytes of samples in memory
};
struct Budgeted {
  double error = 0;  ///< metres or pixels: what was asked for in the end
  Extraction extraction;
  bool kept = true;  ///< false: not even the largest error keeps to the budget
};
/// `cut_at(error)` makes the cut. Searches [0, most] by halving; what it returns keeps to the budget unless
/// not even `most` does. Throws what cut_at throws.
Budgeted extract_within(const Database& db, const Budget& budget, double most,
                        const std::function<std::unique_ptr<CutSurface>(double error)>& cut_at);

}  // namespace patchwork
