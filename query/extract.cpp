#include "query/extract.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include "db/error.h"
#include "db/invariant.h"

namespace patchwork {

namespace {

constexpr double kBudgetFinest = 0x1p-20;  // of the largest error: where the search for a budget begins
constexpr int kBudgetSteps = 24;  // halvings of those 20 octaves: the error is found to 2^-19 octaves

struct Found {
  double bottom;
  double kernel;  // area in level-0 cells: orders patches of one grid exactly
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

// By bottom; ties by the order, the greater first. Ties are many, because a survey's finest patches tend to
// be as good as the survey: within a grid they are told apart by two numbers.
void sort_by_priority(std::vector<Found>& found) {
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    if (a.bottom != b.bottom) return a.bottom < b.bottom;
    if (a.grid == b.grid) return a.kernel != b.kernel ? a.kernel > b.kernel : a.index > b.index;
    CoverageCounts ignored;
    return less(*b.grid, b.index, *a.grid, a.index, ignored);
  });
}

}  // namespace

Extraction extract(const Database& db, const CutSurface& cut, bool strict) {
  const auto start = std::chrono::steady_clock::now();
  Extraction result;
  std::vector<Found> found;
  double largest_asked = 0;
  const Database::Reading reading = db.reading();
  const Grid* last = nullptr;  // neighbours in the tree are mostly of one grid
  const auto emit = [&](const LodEntry& e) {
    if (!last || last->info.id != e.id.grid()) last = &db.grid(e.id.grid());
    const Grid& grid = *last;
    const GridShape::Block block{e.id.level(), e.id.bx(), e.id.by()};
    const std::size_t index = grid.info.shape.index(block.level, block.bx, block.by);
    const PatchRecord& p = grid.patches[index];
    // The tree's boxes are rounded outward; the record decides.
    const ToleranceRange asked =
        cut.over(grid.info.frame, grid.info.shape.domain(block.level, block.bx, block.by));
    if (asked.low >= p.top || (p.bottom > asked.high && (strict || !p.best()))) return;
    if (!cut.meets(grid, block)) return;
    const LatticeRect kernel = grid.info.shape.kernel(block.level, block.bx, block.by);
    found.push_back({p.bottom, area(kernel), &grid, index, e.id});
    largest_asked = std::max(largest_asked, asked.high);
  };
  const VisitCost visited =
      db.tree().visit([&](const LodPage& page, bool inside) { return cut.hits(page, inside); }, emit);
  sort_by_priority(found);
  for (const Found& f : found) {
    result.patches.push_back(f.id);
    result.bound_max = std::max(result.bound_max, bound_of(f));
  }
  if (strict) result.bound_max = std::min(result.bound_max, largest_asked);
  result.error_available = found.empty() ? 0 : found.front().bottom;
  const std::size_t bytes = found.size() * sizeof(PatchSurface::codes);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  result.cost = {visited.nodes, visited.boxes, found.size(), bytes, seconds.count()};
  return result;
}

Extraction extract(const Database& db, const UniformCut& cut) {
  return extract(db, *make_surface(cut), cut.strict);
}
Difference difference(const Extraction& now, const Extraction& before) {
  std::vector<PatchId> a = now.patches, b = before.patches;
  std::sort(a.begin(), a.end()), std::sort(b.begin(), b.end());
  Difference d;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(d.add));
  std::set_difference(b.begin(), b.end(), a.begin(), a.end(), std::back_inserter(d.drop));
  return d;
}

Budgeted extract_within(const Database& db, const Budget& budget, double most,
                        const std::function<std::unique_ptr<CutSurface>(double error)>& cut_at) {
  const auto at = [&](double error) { return Budgeted{error, extract(db, *cut_at(error))}; };
  const auto fits = [&](const Budgeted& b) {
    return b.extraction.patches.size() <= budget.patches && b.extraction.cost.bytes <= budget.bytes;
  };
  Budgeted best = at(0);
  if (fits(best)) return best;
  best = at(most);
  // By octaves: errors of a pyramid double from level to level.
  double low = most * kBudgetFinest, high = most;
  for (int n = 0; n < kBudgetSteps && fits(best); ++n) {
    const double middle = std::sqrt(low * high);
    Budgeted tried = at(middle);
    if (fits(tried))
      high = middle, best = std::move(tried);
    else
      low = middle;
  }
  return best;
}

}  // namespace patchwork
