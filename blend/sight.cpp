#include "blend/sight.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "blend/sight_plan.h"
#include "blend/sight_search.h"

namespace patchwork {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Rays that are evaluated together: so many, and about so many places at them (200 MB).
constexpr std::size_t kWave = 2048;
constexpr double kWavePlaces = 2e6, kPlacesACell = 6;
constexpr double kAlong = 1e-3;     // metres along a ray: how exactly a hit is found
constexpr double kTouching = 1e-6;  // metres: a ray's own ends may lie on the surface
constexpr double kMiss = SightLines::kClearance / 8;
constexpr int kRounds = 12;  // of looking for humps, at most: each halves the steps where one may be

// Evaluations of many rays at once: how far the surface is above the ray, and its bound.
struct Probes {
  std::vector<std::uint32_t> ray;
  std::vector<double> t, above, bound;

  void add(std::size_t r, double at) { ray.push_back(std::uint32_t(r)), t.push_back(at); }
  void evaluate(const Blend& blend, const std::vector<SightPath>& paths) {
    std::vector<double> x(t.size()), y(t.size());
    above.resize(t.size()), bound.resize(t.size());
    for (std::size_t k = 0; k < t.size(); ++k) x[k] = paths[ray[k]].x(t[k]), y[k] = paths[ray[k]].y(t[k]);
    blend.at_points(x, y, {.height = above, .bound = bound, .source = {}, .patch = {}});
    for (std::size_t k = 0; k < t.size(); ++k) above[k] -= paths[ray[k]].z(t[k]);
  }
};

// The nearest approach and the verdict.
Sight judge(const SightPath& path, const std::vector<SightSample>& samples) {
  Sight s;
  s.clearance = INFINITY, s.nearest_distance = s.nearest_bound = kNan, s.hit_distance = s.hit_bound = kNan;
  bool may = false, must = false;
  for (const SightSample& a : samples) {
    may |= a.above + a.bound > kTouching, must |= a.above - a.bound > kTouching;
    if (!(-a.above < s.clearance)) continue;
    s.clearance = -a.above, s.nearest_bound = a.bound;
    s.nearest = {path.x(a.t), path.y(a.t), path.z(a.t) + a.above};
    s.nearest_distance = a.t * path.ground();
  }
  s.verdict = must ? Verdict::hidden : may ? Verdict::undecided : Verdict::visible;
  return s;
}

// The rays of a wave, step by step.
class Wave {
 public:
  Wave(const Blend& blend, std::span<const SightRay> rays, const Air& air) : blend_(blend) {
    for (const SightRay& r : rays) paths.emplace_back(r, air);
  }
  std::vector<SightPath> paths;
  std::vector<std::vector<SightSample>> samples;  // of each ray, ascending

  // Evaluates what `plan(ray)` names of every ray.
  template <class Planner>
  void look(Planner plan) {
    std::vector<SightPlanner::Plan> plans(paths.size());
    tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t r) { plans[r] = plan(r); });
    Probes probes;
    std::vector<SightPlace> places;
    for (std::size_t r = 0; r < paths.size(); ++r)
      for (std::size_t k = 0; k < plans[r].t.size(); ++k)
        probes.add(r, plans[r].t[k]), places.push_back(plans[r].place[k]);
    probes.evaluate(blend_, paths);
    samples.assign(paths.size(), {});
    for (std::size_t k = 0; k < probes.t.size(); ++k)
      samples[probes.ray[k]].push_back({probes.t[k], probes.above[k], probes.bound[k], places[k]});
  }

  /// Where humps may be between what was seen; false where none may.
  bool look_between() {
    Probes probes;
    std::vector<SightPlace> places;
    for (std::size_t r = 0; r < paths.size(); ++r)
      find_humps(samples[r], kMiss,
                 [&](double t, SightPlace place) { probes.add(r, t), places.push_back(place); });
    if (places.empty()) return false;
    probes.evaluate(blend_, paths);
    const auto earlier = [](const SightSample& a, const SightSample& b) { return a.t < b.t; };
    for (std::size_t k = 0; k < places.size();) {
      std::vector<SightSample>& s = samples[probes.ray[k]];
      const auto old = std::ptrdiff_t(s.size());
      for (const std::uint32_t r = probes.ray[k]; k < places.size() && probes.ray[k] == r; ++k)
        s.push_back({probes.t[k], probes.above[k], probes.bound[k], places[k]});
      std::sort(s.begin() + old, s.end(), earlier);
      std::inplace_merge(s.begin(), s.begin() + old, s.end(), earlier);
      s.erase(std::unique(s.begin(), s.end(), [](const auto& a, const auto& b) { return a.t == b.t; }),
              s.end());
    }
    return true;
  }

  void answer(std::span<Sight> out) const {
    std::vector<std::pair<std::uint32_t, HitSearch>> found;
    for (std::size_t r = 0; r < paths.size(); ++r) {
      out[r] = judge(paths[r], samples[r]);
      const double length = paths[r].length();
      if (const auto s = HitSearch::between(samples[r], kTouching, kAlong / length)) {
        out[r].bracket = std::uint32_t(std::ceil(std::min(4e9, s->width() * length / kAlong)));
        found.emplace_back(std::uint32_t(r), *s);
      }
    }
    search(found);
    for (const auto& [r, s] : found) {
      const SightPath& path = paths[r];
      out[r].blocked = true, out[r].searched = s.steps();
      out[r].hit = {path.x(s.at()), path.y(s.at()), path.z(s.at())};
      out[r].hit_distance = s.at() * path.ground(), out[r].hit_bound = s.bound();
    }
  }

 private:
  void search(std::vector<std::pair<std::uint32_t, HitSearch>>& found) const {
    std::vector<std::pair<std::uint32_t, HitSearch>*> open;
    for (auto& f : found) open.push_back(&f);
    for (;;) {
      std::erase_if(open, [](const auto* f) { return f->second.done(); });
      if (open.empty()) return;
      Probes probes;
      for (const auto* f : open) probes.add(f->first, f->second.guess());
      probes.evaluate(blend_, paths);
      for (std::size_t k = 0; k < open.size(); ++k)
        open[k]->second.take(probes.t[k], probes.above[k], probes.bound[k]);
    }
  }

  const Blend& blend_;
};

}  // namespace

double drop(double distance, const Air& air) {
  return air.curved ? distance * distance * (1 - air.refraction) / (2 * air.radius) : 0;
}

SightRay directed_ray(const Point3& from, double azimuth, double elevation, double distance, const Air& air) {
  const double a = azimuth * (M_PI / 180), e = elevation * (M_PI / 180);
  return {from,
          {from.x + distance * std::sin(a), from.y + distance * std::cos(a),
           from.z + distance * std::tan(e) + drop(distance, air)}};
}

struct SightLines::Impl {
  Blend blend;
  SightPlanner planner;
};

SightLines::SightLines(const Database& db, std::span<const PatchId> patches, const BlendOptions& options)
    : impl_(new Impl{Blend(db, patches, options), SightPlanner(db, patches, options)}) {}
SightLines::~SightLines() = default;
const Blend& SightLines::surface() const { return impl_->blend; }

std::vector<Sight> SightLines::find(std::span<const SightRay> rays, const Air& air) const {
  const SightPlanner& planner = impl_->planner;
  std::vector<Sight> sights(rays.size());
  std::size_t n = 0;
  for (std::size_t from = 0; from < rays.size(); from += n) {
    double places = 0;
    for (n = 0; from + n < rays.size() && n < kWave && (n == 0 || places < kWavePlaces); ++n) {
      const SightRay& r = rays[from + n];
      places += kPlacesACell * (1 + std::hypot(r.to.x - r.from.x, r.to.y - r.from.y) / planner.finest_cell());
    }
    Wave wave(impl_->blend, rays.subspan(from, n), air);
    // How near the surface comes to the ray at three likely places: what is farther below need not be looked
    // at.
    wave.look([&](std::size_t r) {
      return SightPlanner::Plan{{0, planner.likely(wave.paths[r]), 1},
                                {SightPlace::begins, SightPlace::begins, SightPlace::begins}};
    });
    std::vector<double> threshold(n);
    for (std::size_t r = 0; r < n; ++r) {
      const double near = judge(wave.paths[r], wave.samples[r]).clearance;
      threshold[r] = std::max({0.0, near, planner.largest_bound()}) + kTouching;
    }
    wave.look([&](std::size_t r) { return planner.plan(wave.paths[r], threshold[r]); });
    for (int round = 0; round < kRounds && wave.look_between(); ++round) continue;
    wave.answer(std::span(sights).subspan(from, n));
  }
  return sights;
}

}  // namespace patchwork
