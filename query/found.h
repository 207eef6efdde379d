// Patches that were found for an answer, put in the order in which they speak (used by extract*.cpp).
#pragma once

#include <vector>

#include "query/extract.h"

namespace patchwork {

struct FoundPatch {
  double bottom;
  double kernel;  ///< area in level-0 cells: orders patches of one grid exactly
  const Grid* grid;
  std::size_t index;  ///< GridShape::index
  PatchId id;
};

/// The answer, but for what finding it cost. Sorts `found`.
Extraction in_order(std::vector<FoundPatch>& found);

}  // namespace patchwork
