#include "query/extract.h"

#include <algorithm>
#include <chrono>

#include "db/error.h"
#include "db/invariant.h"

namespace patchwork {

namespace {

struct Found {
  double bottom;
  const Grid* grid;
  std::size_t index;
  PatchId id;
};

// The bound where the patch speaks: beyond the outer samples of its grid it is larger.
double bound_of(const Found& f) {
  const GridShape& shape = f.grid->info.shape;
  const LatticeRect d = shape.domain(f.id.level(), f.id.bx(), f.id.by());
  const bool beyond = d.i0 < 0 || d.j0 < 0 || d.i1 > shape.width() - 1 || d.j1 > shape.height() - 1;
  return beyond ? f.bottom + f.grid->info.rim_error : f.bottom;
}

// By bottom; ties by the order, the greater first.
void sort_by_priority(std::vector<Found>& found) {
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    if (a.bottom != b.bottom) return a.bottom < b.bottom;
    CoverageCounts ignored;
    return less(*b.grid, b.index, *a.grid, a.index, ignored);
  });
}

}  // namespace

Extraction extract(const Database& db, const UniformCut& cut) {
  if (!(cut.error >= 0)) throw Error("error", "it must be a number of metres, 0 or more");
  const auto start = std::chrono::steady_clock::now();
  Extraction result;
  std::vector<Found> found;
  const Database::Reading reading = db.reading();
  const VisitCost visited =
      db.tree().visit_uniform(cut.region.bounds(), cut.error, [&](const LodTree::Entry& e) {
        const Grid& grid = db.grid(e.id.grid());
        const std::size_t index = grid.info.shape.index(e.id.level(), e.id.bx(), e.id.by());
        const PatchRecord& p = grid.patches[index];
        // The tree's boxes are rounded outward; the record decides.
        const double bottom = p.bottom;
        if (cut.error >= p.top || (bottom > cut.error && (cut.strict || !p.best()))) return;
        if (cut.region.meets(grid, {e.id.level(), e.id.bx(), e.id.by()}))
          found.push_back({bottom, &grid, index, e.id});
      });
  sort_by_priority(found);
  for (const Found& f : found) {
    result.patches.push_back(f.id);
    result.bound_max = std::max(result.bound_max, bound_of(f));
  }
  if (cut.strict) result.bound_max = std::min(result.bound_max, cut.error);
  result.error_available = found.empty() ? 0 : found.front().bottom;
  const std::size_t bytes = found.size() * sizeof(PatchSurface::codes);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  result.cost = {visited.nodes, visited.boxes, found.size(), bytes, seconds.count()};
  return result;
}

}  // namespace patchwork
