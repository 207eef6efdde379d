#include "tools/selftest/selftest.h"

#include <algorithm>
#include <cmath>

namespace patchwork::cli {

Points points_in(Trial& trial, const Extent& e, int count) {
  Points points;
  for (int k = 0; k < count; ++k) {
    const double x = trial.between(e.xmin, e.xmax);
    points.add({x, trial.between(e.ymin, e.ymax)});
  }
  return points;
}

Heights heights_of(const Evaluator& surface, const Points& points) {
  Heights h{std::vector<double>(points.size()), std::vector<double>(points.size()),
            std::vector<std::int32_t>(points.size())};
  surface.at_points(points.x, points.y,
                    {.height = h.height, .bound = h.bound, .source = h.source, .patch = {}});
  return h;
}

Heights heights_of(const Database& db, std::span<const PatchId> patches, const Points& points,
                   const BlendOptions& options) {
  return heights_of(Blend(db, patches, options), points);
}

std::vector<PatchId> patches_at(const Database& db, Point p, double error) {
  return extract(db, {.error = error, .region = Region::inside(Extent{p.x, p.y, p.x, p.y})}).patches;
}

std::vector<BlendOptions> all_blends() {
  std::vector<BlendOptions> all;
  for (const Composition c : {Composition::priority, Composition::weighted})
    for (int k = 0; k <= 2; ++k) all.push_back({.smoothness = k, .composition = c});
  return all;
}

namespace {

std::vector<double> ladder(const Database& db) {
  const double high = db.coarsest_bottom();
  double low = INFINITY;
  for (const Grid& g : db.grids()) low = std::min(low, g.info.accuracy + g.info.quantisation);
  low = std::max(low, 1e-4 * high);
  std::vector<double> errors{0};
  for (int s = 0; s < 6; ++s) errors.push_back(low * std::pow(high / low, s / 5.0));
  return errors;
}

}  // namespace

std::vector<Verdict> run_selftest(const Database& db, const SelfTestOptions& options,
                                  const std::function<void(double)>& progress) {
  Verdict (*const cases[])(Trial&) = {
      bound_holds,    bound_is_what_was_asked, source_exact,   nodata_edges,    rim_weights, continuity,
      spline_stencil, summation_order,         cpu_gpu_parity, rotated_nesting, invariant};
  std::vector<Verdict> verdicts;
  for (std::size_t k = 0; k < std::size(cases); ++k) {
    Trial trial{db, options, std::mt19937_64(options.seed + k), ladder(db)};
    verdicts.push_back(cases[k](trial));
    progress(double(k + 1) / double(std::size(cases) + 1));
  }
  Trial trial{db, options, std::mt19937_64(options.seed), ladder(db)};
  for (Verdict& v : changes(trial)) verdicts.push_back(std::move(v));
  return verdicts;
}

}  // namespace patchwork::cli
