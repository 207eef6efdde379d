#include "query/extract.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "db/error.h"
#include "db/stopwatch.h"
#include "query/found.h"

namespace patchwork {

namespace {

constexpr std::size_t kKept = std::size_t{1} << 19;  // patches (20 MB) that a thread keeps room for
constexpr double kBudgetFinest = 0x1p-20;  // of the largest error: where the search for a budget begins
constexpr int kBudgetSteps = 24;  // halvings of those 20 octaves: the error is found to 2^-19 octaves

}  // namespace

Extraction extract(const Database& db, const CutSurface& cut, bool strict) {
  const Stopwatch watch;
  thread_local std::vector<FoundPatch> found;  // its memory serves the next answer
  found.clear();
  double largest_asked = 0;
  const Database::Reading reading = db.reading();
  const Grid* last = nullptr;  // neighbours in the tree are mostly of one grid
  const auto emit = [&](const LodEntry& e) {
    if (!last || last->info.id != e.id.grid()) last = &db.grid(e.id.grid());
    const Grid& grid = *last;
    const GridShape::Block block{e.id.level(), e.id.bx(), e.id.by()};
    if (!grid.info.shape.has(block.level, block.bx, block.by))
      throw Error(db.path(), "the R-tree names a patch that is not there", "run: patchwork check --repair");
    const std::size_t index = grid.info.shape.index(block.level, block.bx, block.by);
    const PatchRecord& p = grid.patches[index];
    // The tree's boxes are rounded outward; the record decides.
    const ToleranceRange asked =
        cut.over(grid.info.frame, grid.info.shape.domain(block.level, block.bx, block.by));
    if (asked.low >= p.top || (p.bottom > asked.high && (strict || !p.best()))) return;
    if (!cut.meets(grid, block)) return;
    const LatticeRect kernel = grid.info.shape.kernel(block.level, block.bx, block.by);
    found.push_back({p.bottom, kernel.area(), &grid, index, e.id});
    largest_asked = std::max(largest_asked, asked.high);
  };
  const VisitCost visited =
      db.tree().visit([&](const LodPage& page, bool inside) { return cut.hits(page, inside); }, emit);
  Extraction result = in_order(found);
  if (found.capacity() > kKept) std::vector<FoundPatch>().swap(found);
  if (strict) result.bound_max = std::min(result.bound_max, largest_asked);
  result.cost.nodes = visited.nodes, result.cost.boxes = visited.boxes;
  result.cost.seconds = watch.seconds();
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
  best.kept = fits(best);
  // By octaves: errors of a pyramid double from level to level.
  double low = most * kBudgetFinest, high = most;
  for (int n = 0; n < kBudgetSteps && best.kept; ++n) {
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
