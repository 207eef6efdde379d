#include "blend/batch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "blend/kernels.h"
#include "blend/weight.h"

namespace patchwork {

namespace {

constexpr int kSide = PatchSurface::kSide;

kernels::WindowMap window_map(const Blend::Placed& p) {
  return {p.x0, p.y0, p.ua, p.ub, p.va, p.vb, p.first_i, p.first_j};
}

int cell_at(double u) { return std::clamp(int(u), 1, kSide - 3); }

// A property of the closed cells at a window point: on an edge or a corner any of the cells that share it
// will do.
bool any_cell(const std::array<std::uint8_t, kSide * kSide>& cells, double u, double v) {
  const int i = cell_at(u), j = cell_at(v);
  const bool left = u == i, below = v == j;
  const auto at = [&](int a, int b) { return cells[size_t(b * kSide + a)] != 0; };
  return at(i, j) || (left && at(i - 1, j)) || (below && at(i, j - 1)) || (left && below && at(i - 1, j - 1));
}

// 1 where all cells around are real, 0 on those that are not, C^k between: B-splines over flags of the
// vertices.
double hole_factor(const PatchSurface::Holes& h, double u, double v, int smoothness) {
  const int i = cell_at(u), j = cell_at(v);
  const double s = u - i, t = v - j;
  const auto at = [&](const auto& flags, int a, int b) -> double {
    return flags[size_t((j + b) * kSide + i + a)];
  };
  if (smoothness == 0) {
    const double low = at(h.near, 0, 0) + s * (at(h.near, 1, 0) - at(h.near, 0, 0));
    const double high = at(h.near, 0, 1) + s * (at(h.near, 1, 1) - at(h.near, 0, 1));
    return low + t * (high - low);
  }
  double rows[4], sum = 0;
  for (int b = -1; b <= 2; ++b) {
    const double flags[4] = {at(h.wide, -1, b), at(h.wide, 0, b), at(h.wide, 1, b), at(h.wide, 2, b)};
    sum += flags[0] + flags[1] + flags[2] + flags[3];
    rows[b + 1] = cubic_bspline(flags[0], flags[1], flags[2], flags[3], s);
  }
  return sum == 16 ? 1 : std::min(1.0, cubic_bspline(rows[0], rows[1], rows[2], rows[3], t));
}

}  // namespace

LatticeRect Blend::Placed::window_bounds(const Point corners[4]) const {
  LatticeRect r{INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (int k = 0; k < 4; ++k) {
    const double dx = corners[k].x - x0, dy = corners[k].y - y0;
    const double u = (ua * dx + ub * dy) - first_i, v = (va * dx + vb * dy) - first_j;
    r = {std::min(r.i0, u), std::min(r.j0, v), std::max(r.i1, u), std::max(r.j1, v)};
  }
  return r;
}

void Batch::reset(std::size_t n) {
  for (auto* a : {&u_, &v_, &weight_, &value_}) a->resize(kPoints);
  at_.resize(kPoints);
  height.assign(n, 0), bound.assign(n, 0), sum_.assign(n, 0), most_.assign(n, 0), rest_.assign(n, 1);
  low_.assign(n, INFINITY), high_.assign(n, -INFINITY);
  source.assign(n, 0), patch.assign(n, -1), reads_.assign(n, 0);
}

// Keeps the points that the patch's domain holds and that are not settled yet; false if there are none.
bool Batch::select(const Blend::Placed& p, const BlendOptions& options) {
  const int n = int(x.size());
  kernels::to_window(window_map(p), x.data(), y.data(), n, u_.data(), v_.data());
  if (options.composition == Composition::priority)
    kernels::ramp_weights(options.smoothness, p.kernel, p.domain, u_.data(), v_.data(), n, weight_.data());
  else
    kernels::wendland_weights(options.smoothness, p.domain, u_.data(), v_.data(), n, weight_.data());
  std::size_t kept = 0;
  for (std::size_t k = 0; k < size_t(n); ++k) {
    u_[kept] = u_[k], v_[kept] = v_[k], weight_[kept] = weight_[k], at_[kept] = std::uint32_t(k);
    kept += weight_[k] >= 0 && rest_[k] > 0;
  }
  at_.resize(kept);
  return kept > 0;
}

void Batch::fade_at_holes(const PatchSurface::Holes& holes, int smoothness) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < at_.size(); ++k) {
    if (!any_cell(holes.answering, u_[k], v_[k])) continue;
    const double factor = hole_factor(holes, u_[k], v_[k], smoothness);
    u_[kept] = u_[k], v_[kept] = v_[k], weight_[kept] = weight_[k] * factor, at_[kept] = at_[k];
    ++kept;
  }
  at_.resize(kept);
}

void Batch::read(const Blend::Placed& p, const PatchSurface& s, int smoothness) {
  kernels::interpolate(smoothness, s.codes.data(), u_.data(), v_.data(), int(at_.size()), value_.data());
  for (std::size_t k = 0; k < at_.size(); ++k) value_[k] = p.quantum * (p.origin + value_[k]) + p.base;
}

void Batch::add(const Blend::Placed& p, std::uint32_t place, const PatchSurface& s, bool priority) {
  for (std::size_t k = 0; k < at_.size(); ++k) {
    const std::uint32_t i = at_[k];
    const double w = (weight_[k] + kWeightFloor) * (priority ? rest_[i] : p.volume), h = value_[k];
    const bool beyond =
        u_[k] < p.samples.i0 || u_[k] > p.samples.i1 || v_[k] < p.samples.j0 || v_[k] > p.samples.j1;
    const double e = beyond ? p.error + p.rim : p.error;
    sum_[i] += w, height[i] += w * h, bound[i] += w * e;
    low_[i] = std::min(low_[i], h), high_[i] = std::max(high_[i], h);
    ++reads_[i];
    if (w > most_[i]) {
      most_[i] = w, patch[i] = std::int32_t(place);
      source[i] = s.holes && !any_cell(s.holes->real, u_[k], v_[k]) ? -p.source : p.source;
    }
    if (priority) rest_[i] *= 1 - weight_[k];
  }
}

void Batch::compose(const Database& db, const std::vector<Blend::Placed>& placed,
                    const std::vector<std::uint32_t>& candidates, bool inside, const BlendOptions& options) {
  const bool priority = options.composition == Composition::priority;
  reset(x.size());
  if (inside && options.fast_path) {
    const Blend::Placed& p = placed[candidates.front()];
    const auto s = db.surface(p.id);
    const int n = int(x.size());
    kernels::to_window(window_map(p), x.data(), y.data(), n, u_.data(), v_.data());
    kernels::interpolate(options.smoothness, s->codes.data(), u_.data(), v_.data(), n, value_.data());
    for (std::size_t k = 0; k < x.size(); ++k) height[k] = p.quantum * (p.origin + value_[k]) + p.base;
    std::fill(bound.begin(), bound.end(), p.error);
    std::fill(source.begin(), source.end(), p.source);
    std::fill(patch.begin(), patch.end(), std::int32_t(candidates.front()));
    std::fill(reads_.begin(), reads_.end(), 1);
    finish(options);
    return;
  }
  for (const std::uint32_t c : candidates) {
    at_.resize(kPoints);
    if (!select(placed[c], options)) continue;
    const auto s = db.surface(placed[c].id);
    if (s->holes) fade_at_holes(*s->holes, options.smoothness);
    read(placed[c], *s, options.smoothness);
    add(placed[c], c, *s, priority);
    if (priority && std::all_of(rest_.begin(), rest_.end(), [](double r) { return r <= 0; })) break;
  }
  for (std::size_t k = 0; k < x.size(); ++k)
    if (reads_[k]) height[k] = std::clamp(height[k] / sum_[k], low_[k], high_[k]), bound[k] /= sum_[k];
  finish(options);
}

void Batch::finish(const BlendOptions& options) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  counts = {x.size(), 0, 0, 0};
  for (std::size_t k = 0; k < x.size(); ++k) {
    counts.contributions += reads_[k], counts.most = std::max<std::uint64_t>(counts.most, reads_[k]);
    if (reads_[k] == 0 || (options.strict && bound[k] > options.error))
      height[k] = bound[k] = nan, source[k] = 0, patch[k] = -1;
    else
      counts.bound_max = std::max(counts.bound_max, bound[k]);
  }
}

}  // namespace patchwork
