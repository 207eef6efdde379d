#include "query/cost_model.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "db/stopwatch.h"

namespace patchwork {

namespace {

constexpr double kCalibration = 0.3;         // seconds
constexpr double kUsed = 0.9;                // of a time budget, by what is expected
constexpr double kRung = 1.189207115002721;  // a quarter octave
constexpr int kRungs = 96;
constexpr int kTries = 12;  // to keep to a time budget that an answer has missed

}  // namespace

CostModel calibrate(const Database& db) {
  std::vector<Measured> costs;
  const Stopwatch watch;
  double error = std::max(1.0, 2 * db.coarsest_bottom());
  for (; costs.size() < 4 || watch.seconds() < kCalibration; error /= 2) {
    if (costs.size() > std::size_t(kRungs)) break;
    const UniformCut cut{.error = error};
    std::array<Cost, 3> three;  // the first one reads what was not read before
    for (Cost& c : three) c = extract(db, cut).cost;
    std::sort(three.begin(), three.end(), [](const Cost& a, const Cost& b) { return a.seconds < b.seconds; });
    const Cost& c = three[1];
    costs.push_back(
        {.pages = double(c.nodes), .patches = double(c.patches), .find = std::max(c.seconds, 1e-9)});
  }
  return fit(costs);
}

Cost expect(const Database& db, const CutSurface& cut, const CostModel& model) {
  const Database::Reading reading = db.reading();
  const auto ignore = [](const LodEntry&) {};
  std::size_t leaves = 0;
  const VisitCost inner = db.tree().visit(
      [&](const LodPage& page, bool inside) {
        LodHits hits = cut.hits(page, inside);
        if (page.level == 1) leaves += std::size_t(std::popcount(hits.met)), hits.met = 0;
        return hits;
      },
      ignore);
  // Every n-th leaf, the first one included.
  const std::size_t stride = std::max<std::size_t>(1, (leaves + kSampledLeaves - 1) / kSampledLeaves);
  std::size_t leaf = 0, sampled = 0, found = 0, compared = 0;
  db.tree().visit(
      [&](const LodPage& page, bool inside) {
        LodHits hits = cut.hits(page, inside);
        if (page.level == 0) ++sampled, found += std::size_t(std::popcount(hits.met)), compared += page.count;
        if (page.level != 1) return hits;
        for (std::uint64_t left = hits.met; left; left &= left - 1)
          if (leaf++ % stride) hits.met &= ~(left & -left);
        return hits;
      },
      ignore);
  const double scale = sampled > 0 && leaves > 0 ? double(leaves) / double(sampled) : 1;
  Cost cost;
  cost.nodes = inner.nodes + leaves;
  cost.boxes = inner.boxes + std::size_t(std::llround(scale * double(leaves > 0 ? compared : 0)));
  cost.patches = std::size_t(std::llround(scale * double(found)));
  cost.bytes = cost.patches * sizeof(PatchSurface::codes);
  cost.seconds = model.seconds(double(cost.nodes), double(cost.patches));
  return cost;
}

Budgeted extract_in_time(const Database& db, const CostModel& model, double seconds, double most,
                         const std::function<std::unique_ptr<CutSurface>(double error)>& cut_at) {
  const auto fits = [&](double error) {
    return expect(db, *cut_at(error), model).seconds <= kUsed * seconds;
  };
  double error = most, finer = most / kRung;
  int rung = 0;
  for (; rung < kRungs && fits(finer); ++rung) error = finer, finer /= kRung;
  if (rung == kRungs && fits(0)) error = 0;
  Budgeted best{error, extract(db, *cut_at(error))};
  for (int n = 0; n < kTries && best.extraction.cost.seconds > seconds; ++n) {
    if (n % 2) best.error = std::min(most, best.error > 0 ? best.error * kRung : finer);
    best.extraction = extract(db, *cut_at(best.error));
  }
  best.kept = best.extraction.cost.seconds <= seconds;
  return best;
}

}  // namespace patchwork
