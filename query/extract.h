// The extraction: which patches a cut needs, in the order in which they speak, and what finding them cost.
#pragma once

#include <cstddef>
#include <vector>

#include "db/database.h"
#include "query/region.h"

namespace patchwork {

/// A uniform cut: e(x, y) = error over the region.
struct UniformCut {
  double error = 0;  ///< metres; 0 means the best there is
  Region region = {};
  bool strict =
      false;  ///< only patches with bottom <= error; else, where that is not available, the best there is
};

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
  double error_available = 0;  ///< metres: the smallest bottom among them
};

/// Throws Error: error negative or not a number.
Extraction extract(const Database& db, const UniformCut& cut);

}  // namespace patchwork
