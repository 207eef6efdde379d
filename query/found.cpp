#include "query/found.h"

#include <algorithm>

#include "db/invariant.h"

namespace patchwork {

namespace {

// The bound where the patch speaks: beyond the outer samples of its grid it is larger.
double bound_of(const FoundPatch& f) {
  const GridShape& shape = f.grid->info.shape;
  const LatticeRect d = shape.domain(f.id.level(), f.id.bx(), f.id.by());
  const bool beyond = d.i0 < 0 || d.j0 < 0 || d.i1 > shape.width() - 1 || d.j1 > shape.height() - 1;
  return beyond ? f.bottom + f.grid->info.rim_error : f.bottom;
}

// By bottom; ties by the order, the greater first. Ties are many, because a survey's finest patches tend to
// be as good as the survey: within a grid they are told apart by two numbers.
void sort_by_priority(std::vector<FoundPatch>& found) {
  std::sort(found.begin(), found.end(), [](const FoundPatch& a, const FoundPatch& b) {
    if (a.bottom != b.bottom) return a.bottom < b.bottom;
    if (a.grid == b.grid) return a.kernel != b.kernel ? a.kernel > b.kernel : a.index > b.index;
    CoverageCounts ignored;
    return less(*b.grid, b.index, *a.grid, a.index, ignored);
  });
}

}  // namespace

Extraction in_order(std::vector<FoundPatch>& found) {
  sort_by_priority(found);
  Extraction result;
  result.patches.reserve(found.size());
  for (const FoundPatch& f : found) {
    result.patches.push_back(f.id);
    result.bound_max = std::max(result.bound_max, bound_of(f));
  }
  result.error_available = found.empty() ? 0 : found.front().bottom;
  result.cost.patches = found.size(), result.cost.bytes = found.size() * sizeof(PatchSurface::codes);
  return result;
}

}  // namespace patchwork
