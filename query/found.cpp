#include "query/found.h"

#include <algorithm>
#include <boost/sort/pdqsort/pdqsort.hpp>

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
// be as good as the survey: within a grid they are told apart by two numbers, without a branch.
void sort_by_priority(std::vector<FoundPatch>& found) {
  boost::sort::pdqsort_branchless(found.begin(), found.end(), [](const FoundPatch& a, const FoundPatch& b) {
    const bool same = a.bottom == b.bottom, alike = same & (a.kernel == b.kernel);
    return bool((a.bottom < b.bottom) | (same & (a.kernel > b.kernel)) | (alike & (a.index > b.index)));
  });
  for (auto begin = found.begin(); begin != found.end();) {
    auto end = begin;
    bool one_grid = true;
    for (; end != found.end() && end->bottom == begin->bottom; ++end) one_grid &= end->grid == begin->grid;
    if (!one_grid)
      std::sort(begin, end, [](const FoundPatch& a, const FoundPatch& b) {
        CoverageCounts ignored;
        if (a.grid != b.grid) return less(*b.grid, b.index, *a.grid, a.index, ignored);
        return a.kernel != b.kernel ? a.kernel > b.kernel : a.index > b.index;
      });
    begin = end;
  }
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
  result.bound_inside = found.empty() ? 0 : found.back().bottom;
  result.cost.patches = found.size(), result.cost.bytes = found.size() * sizeof(PatchSurface::codes);
  return result;
}

}  // namespace patchwork
