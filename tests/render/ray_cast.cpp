#include "tests/render/ray_cast.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>

namespace patchwork {

// Every ray is sampled at equal steps from where it enters the surface's box to where it leaves it. `gap` is
// the ray's height above the surface: a change of its sign is a hit, narrowed by halving. Where the gap has a
// least value between three samples that might hide a dip below 0, the samples between are taken too. Many
// rays are marched side by side, because the blend takes many points at once.

namespace {

constexpr int kSamples = 64;               // of a ray at once
constexpr std::size_t kRaysAtOnce = 4096;  // 262 144 points
constexpr int kFiner = 32;                 // samples between three where the gap may dip
constexpr int kHalvings = 60;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct Marcher {
  const CastSurface& surface;
  const CastOptions& options;

  double drop(const Ray& ray, double t) const {
    if (!options.curvature) return 0;
    const double d = t * std::hypot(ray.direction.x, ray.direction.y);
    return effects::drop(*options.curvature, d);
  }

  // Gaps at ray parameters t[k] of the rays of[k].
  std::vector<double> gaps(std::span<const Ray> rays, const std::vector<std::size_t>& of,
                           const std::vector<double>& t) const {
    std::vector<double> x(t.size()), y(t.size()), gap(t.size());
    for (std::size_t k = 0; k < t.size(); ++k) {
      const glm::dvec3 p = rays[of[k]].at(t[k]);
      x[k] = p.x, y[k] = p.y;
    }
    surface.heights(x, y, gap);
    for (std::size_t k = 0; k < t.size(); ++k)
      gap[k] = rays[of[k]].at(t[k]).z + drop(rays[of[k]], t[k]) - gap[k];
    return gap;
  }

  double gap(const Ray& ray, double t) const { return gaps({&ray, 1}, {0}, {t})[0]; }

  // The part of the ray inside the surface's box; empty (from > to) where it misses it.
  std::pair<double, double> part(const Ray& ray) const {
    double from = options.near, to = options.far;
    const auto clip = [&](double origin, double direction, double low, double high) {
      const double a = (low - origin) / direction, b = (high - origin) / direction;
      if (direction != 0) {
        from = std::max(from, std::min(a, b)), to = std::min(to, std::max(a, b));
      } else if (origin < low || origin > high) {
        to = -INFINITY;
      }
    };
    const Extent& e = surface.extent;
    clip(ray.origin.x, ray.direction.x, e.xmin, e.xmax);
    clip(ray.origin.y, ray.direction.y, e.ymin, e.ymax);
    // What sinks may be met below the lowest height; and a step more, so that no hit lies at an end.
    const double most = std::isfinite(to) && to > 0 ? drop(ray, to) : 0;
    clip(ray.origin.z, ray.direction.z, surface.lowest - most - surface.step, surface.highest + surface.step);
    return {from, to};
  }

  // Between a sample with data and one without: the last place with data.
  double rim(const Ray& ray, double with, double without) const {
    for (int n = 0; n < kHalvings; ++n) {
      const double middle = 0.5 * (with + without);
      (std::isnan(gap(ray, middle)) ? without : with) = middle;
    }
    return with;
  }

  Hit hit(const Ray& ray, double a, double b, double gap_a) const {
    for (int n = 0; n < kHalvings; ++n) {
      const double middle = 0.5 * (a + b), g = gap(ray, middle);
      if (std::isnan(g)) break;  // a hole narrower than a sample
      ((g > 0) == (gap_a > 0) ? a : b) = middle;
    }
    return {.covered = true, .from_below = gap_a <= 0, .distance = b, .at = ray.at(b)};
  }

  // A hit between two neighbouring samples.
  std::optional<Hit> between(const Ray& ray, double a, double b, double gap_a, double gap_b) const {
    if (std::isnan(gap_a) && std::isnan(gap_b)) return {};
    if (std::isnan(gap_a)) a = rim(ray, b, a), gap_a = gap(ray, a);
    if (std::isnan(gap_b)) b = rim(ray, a, b), gap_b = gap(ray, b);
    if ((gap_a > 0) == (gap_b > 0)) return {};
    return hit(ray, a, b, gap_a);
  }

  // May the gap pass 0 unseen between three samples of one sign?
  static bool may_dip(double before, double middle, double after) {
    const double m = std::abs(middle),
                 steepest = std::max(std::abs(before - middle), std::abs(after - middle));
    return m <= std::abs(before) && m <= std::abs(after) && m < 2 * steepest;
  }

  std::optional<Hit> look_closer(const Ray& ray, double from, double to) const {
    std::vector<double> t(kFiner + 1);
    for (int k = 0; k <= kFiner; ++k) t[std::size_t(k)] = from + (to - from) * k / kFiner;
    const std::vector<double> g = gaps({&ray, 1}, std::vector<std::size_t>(t.size(), 0), t);
    for (std::size_t k = 1; k < t.size(); ++k)
      if (const auto h = between(ray, t[k - 1], t[k], g[k - 1], g[k])) return h;
    return {};
  }

  // Samples t of one ray with their gaps, in order; the first of them was the last of those before.
  std::optional<Hit> first_hit(const Ray& ray, std::span<const double> t, std::span<const double> g) const {
    for (std::size_t k = 1; k < t.size(); ++k) {
      if (k + 1 < t.size() && may_dip(g[k - 1], g[k], g[k + 1]))
        if (const auto h = look_closer(ray, t[k - 1], t[k + 1])) return h;
      if (const auto h = between(ray, t[k - 1], t[k], g[k - 1], g[k])) return h;
    }
    return {};
  }

  glm::dvec3 normal(double x, double y) const {
    const double h = surface.step / 16;
    const double px[] = {x - h, x + h, x, x}, py[] = {y, y, y - h, y + h};
    double z[4];
    surface.heights(px, py, z);
    return glm::normalize(glm::dvec3(z[0] - z[1], z[2] - z[3], 2 * h));
  }
};

struct March {
  std::size_t ray;
  double from, to;
};

}  // namespace

std::vector<Hit> cast(const CastSurface& surface, std::span<const Ray> all, const CastOptions& options) {
  const Marcher m{surface, options};
  std::vector<Hit> hits(all.size());
  for (std::size_t first = 0; first < all.size(); first += kRaysAtOnce) {
    const auto rays = all.subspan(first, std::min(kRaysAtOnce, all.size() - first));
    std::vector<March> marches;
    for (std::size_t k = 0; k < rays.size(); ++k)
      if (const auto [from, to] = m.part(rays[k]); from < to) marches.push_back({k, from, to});
    while (!marches.empty()) {
      std::vector<std::size_t> of;
      std::vector<double> t;
      for (const March& march : marches)
        for (int k = 0; k < kSamples; ++k)
          of.push_back(march.ray), t.push_back(std::min(march.to, march.from + k * surface.step));
      const std::vector<double> gaps = m.gaps(rays, of, t);
      std::vector<March> left;
      for (std::size_t n = 0; n < marches.size(); ++n) {
        const March& march = marches[n];
        const auto ts = std::span(t).subspan(n * kSamples, kSamples);
        const auto gs = std::span<const double>(gaps).subspan(n * kSamples, kSamples);
        if (const auto h = m.first_hit(rays[march.ray], ts, gs))
          hits[first + march.ray] = *h;
        else if (ts.back() < march.to)  // two samples are seen again, so that every three neighbours are
          left.push_back({march.ray, ts[kSamples - 2], march.to});
      }
      marches = std::move(left);
    }
  }
  for (Hit& h : hits)
    if (h.covered) h.normal = m.normal(h.at.x, h.at.y);
  return hits;
}

std::vector<Hit> cast(const CastSurface& surface, const Camera& camera, const CastOptions& options) {
  std::vector<Ray> rays;
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) rays.push_back(ray(camera, column, row));
  return cast(surface, rays, options);
}

CastSurface surface_of(std::function<double(double, double)> z, double lowest, double highest, double step) {
  return {.heights =
              [z = std::move(z)](auto x, auto y, auto out) {
                for (std::size_t k = 0; k < x.size(); ++k) out[k] = z(x[k], y[k]);
              },
          .lowest = lowest,
          .highest = highest,
          .step = step};
}

CastSurface surface_of(const Database& db, std::span<const PatchId> patches, const Evaluator& blend) {
  CastSurface s{.heights =
                    [&blend](auto x, auto y, auto z) {
                      blend.at_points(x, y, {z, {}, {}, {}});
                    },
                .extent = db.extent(),
                .lowest = INFINITY,
                .highest = -INFINITY,
                .step = INFINITY};
  HeightRange all;
  for (const Grid& g : db.grids()) all.add(g.info.surface_heights());
  const double beyond = db.coarsest_bottom();  // by so much a coarser patch may miss the level-0 surface
  s.lowest = all.lowest - beyond, s.highest = all.highest + beyond;
  for (const PatchId id : patches) {
    const Frame& f = db.grid(id.grid()).info.frame;
    s.step = std::min(s.step, std::ldexp(f.finer_step(), id.level()) / 4);
  }
  return s;
}

}  // namespace patchwork
