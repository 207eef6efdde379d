#include "blend/batch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "blend/kernels.h"
#include "blend/weight.h"

namespace patchwork {

namespace {

constexpr int kSide = PatchSurface::kSide;

kernels::WindowMap window_map(const Blend::Placed& p) {
  return {p.x0, p.y0, p.ua, p.ub, p.va, p.vb, p.first_i, p.first_j};
}

// Of a cell: nearer to an edge than this a point lies on it. A raster that is meant to hit the samples misses
// them by the rounding of its origin (1e-9 m at 5e6 m, 1e-7 of a cell of 1 cm).
constexpr double kOnEdge = 0x1p-20;

int cell_at(double u) { return std::clamp(int(u), 1, kSide - 3); }

// A property of the closed cells at a window point: on an edge or a corner any of the cells that share it
// will do.
bool any_cell(const std::array<std::uint8_t, kSide * kSide>& cells, double u, double v) {
  const int i = cell_at(u), j = cell_at(v);
  const int i0 = u - i <= kOnEdge ? i - 1 : i, i1 = i + 1 - u <= kOnEdge ? i + 1 : i;
  const int j0 = v - j <= kOnEdge ? j - 1 : j, j1 = j + 1 - v <= kOnEdge ? j + 1 : j;
  for (int b = j0; b <= j1; ++b)
    for (int a = i0; a <= i1; ++a)
      if (cells[size_t(b * kSide + a)] != 0) return true;
  return false;
}

// 1 a feather away from cells without data, 0 on them, C^k between: B-splines over the capped distance of the
// vertices.
double hole_factor(const PatchSurface::Holes& h, double u, double v, int smoothness) {
  const int i = cell_at(u), j = cell_at(v);
  const double s = u - i, t = v - j;
  const auto at = [&](const auto& distance, int a, int b) -> double {
    return distance[size_t((j + b) * kSide + i + a)];
  };
  if (smoothness == 0) {
    const double low = at(h.near, 0, 0) + s * (at(h.near, 1, 0) - at(h.near, 0, 0));
    const double high = at(h.near, 0, 1) + s * (at(h.near, 1, 1) - at(h.near, 0, 1));
    return (low + t * (high - low)) / kFeatherCells;
  }
  double rows[4], sum = 0;
  for (int b = -1; b <= 2; ++b) {
    const double d[4] = {at(h.wide, -1, b), at(h.wide, 0, b), at(h.wide, 1, b), at(h.wide, 2, b)};
    sum += d[0] + d[1] + d[2] + d[3];
    rows[b + 1] = cubic_bspline(d[0], d[1], d[2], d[3], s);
  }
  if (sum == 16 * kFeatherCells) return 1;
  return std::clamp(cubic_bspline(rows[0], rows[1], rows[2], rows[3], t) / kFeatherCells, 0.0, 1.0);
}

}  // namespace

Batch::Batch() {
  for (auto* a : {&height, &bound, &rest_, &sum_, &low_, &high_, &worst_, &most_}) a->resize(kPoints);
  for (auto* a : {&left_at_, &reads_, &touched_}) a->resize(kPoints);
  for (auto* a : {&source, &patch}) a->resize(kPoints);
  for (Reached* r : {&whole_, &part_}) {
    for (auto* a : {&r->u, &r->v, &r->weight, &r->value, &r->floor}) a->resize(kPoints);
    r->at.resize(kPoints);
  }
}

const PatchSurface& Batch::surface(const Database& db, const Blend::Placed& p, std::uint32_t place) {
  auto& held = held_[place % kHeld];
  if (!held || held_place_[place % kHeld] != place)
    held = db.surface(p.id), held_place_[place % kHeld] = place;
  return *held;
}

// Weights of the points that are left, in whole_'s u, v, weight; -1 where the patch does not reach.
void Batch::weigh(const Blend::Placed& p, const BlendOptions& options) {
  Reached& r = whole_;
  kernels::to_window(window_map(p), x.data(), y.data(), int(left_), r.u.data(), r.v.data());
  if (options.composition == Composition::priority)
    kernels::ramp_weights(options.smoothness, p.kernel, p.ramp, p.domain, r.u.data(), r.v.data(), int(left_),
                          r.weight.data());
  else
    kernels::wendland_weights(options.smoothness, p.domain, r.u.data(), r.v.data(), int(left_),
                              r.weight.data());
}

// Points at full weight that nothing was read for yet are settled by this patch alone: whole_. The others
// that it reaches go to part_, and those without full weight stay. All three without branches, which would be
// mispredicted along every rim.
void Batch::split() {
  std::size_t whole = 0, part = 0, left = 0;
  for (std::size_t k = 0; k < left_; ++k) {
    const double u = whole_.u[k], v = whole_.v[k], w = whole_.weight[k], px = x[k], py = y[k];
    const std::uint32_t at = left_at_[k];
    const bool alone = (w == 1) & (reads_[at] == 0);
    whole_.u[whole] = u, whole_.v[whole] = v, whole_.at[whole] = at;
    part_.u[part] = u, part_.v[part] = v, part_.weight[part] = w, part_.at[part] = at;
    x[left] = px, y[left] = py, left_at_[left] = at;
    whole += alone, part += (w >= 0) & !alone & (rest_[at] > 0), left += w < 1;
  }
  whole_.n = whole, part_.n = part, left_ = left;
}

// Every point that the patch reaches goes to part_, and all stay.
void Batch::take_all() {
  std::size_t part = 0;
  for (std::size_t k = 0; k < left_; ++k) {
    const std::uint32_t at = left_at_[k];
    part_.u[part] = whole_.u[k], part_.v[part] = whole_.v[k], part_.weight[part] = whole_.weight[k];
    part_.at[part] = at;
    const bool reached = whole_.weight[k] >= 0, open = rest_[at] > 0;
    part += reached & open;
  }
  whole_.n = 0, part_.n = part;
}

void Batch::drop_settled() {
  std::size_t left = 0;
  for (std::size_t k = 0; k < left_; ++k) {
    const std::uint32_t at = left_at_[k];
    x[left] = x[k], y[left] = y[k], left_at_[left] = at;
    left += rest_[at] > 0;
  }
  left_ = left;
}

// Before holes take from the weights; ramps that end at the outer samples are taken up to the domain's rim.
void Batch::keep_floors(const Blend::Placed& p, const BlendOptions& options) {
  Reached& r = part_;
  if (options.composition == Composition::priority && p.has_rim)
    kernels::ramp_weights(options.smoothness, p.kernel, p.domain, p.domain, r.u.data(), r.v.data(), int(r.n),
                          r.floor.data());
  else
    std::copy_n(r.weight.begin(), r.n, r.floor.begin());
}

void Batch::fade_at_holes(const PatchSurface::Holes& holes, int smoothness) {
  Reached& r = part_;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < r.n; ++k) {
    if (!any_cell(holes.answering, r.u[k], r.v[k])) continue;
    const double factor = hole_factor(holes, r.u[k], r.v[k], smoothness);
    r.u[kept] = r.u[k], r.v[kept] = r.v[k], r.weight[kept] = r.weight[k] * factor, r.at[kept] = r.at[k];
    r.floor[kept] = r.floor[k];
    ++kept;
  }
  r.n = kept;
}

void Batch::read(const Blend::Placed& p, const PatchSurface& s, int smoothness, Reached& r) {
  kernels::interpolate(smoothness, s.codes.data(), r.u.data(), r.v.data(), int(r.n), r.value.data());
  for (std::size_t k = 0; k < r.n; ++k) r.value[k] = p.quantum * (p.origin + r.value[k]) + p.base;
}

// What add() and finish() would make of one patch at full weight: its height and its error, to the last bit.
void Batch::settle(const Blend::Placed& p, std::uint32_t place) {
  for (std::size_t k = 0; k < whole_.n; ++k) {
    const std::uint32_t i = whole_.at[k];
    height[i] = whole_.value[k], bound[i] = p.error, reads_[i] = 1;
  }
  for (std::size_t k = 0; named_ && k < whole_.n; ++k)
    source[whole_.at[k]] = p.source, patch[whole_.at[k]] = std::int32_t(place);
  if (whole_.n == 0) return;
  settled_ += whole_.n, counts.contributions += whole_.n;
  counts.most = std::max<std::uint64_t>(counts.most, 1),
  counts.bound_max = std::max(counts.bound_max, p.error);
}

void Batch::add(const Blend::Placed& p, std::uint32_t place, const PatchSurface& s, bool priority) {
  const Reached& r = part_;
  for (std::size_t k = 0; k < r.n; ++k) {
    const std::uint32_t i = r.at[k];
    const double own = r.weight[k] + (kWeightFloor * r.floor[k] + kRimFloor);
    const double w = own * (priority ? rest_[i] : p.volume), h = r.value[k];
    const bool beyond = r.u[k] < p.samples.i0 - kOnEdge || r.u[k] > p.samples.i1 + kOnEdge ||
                        r.v[k] < p.samples.j0 - kOnEdge || r.v[k] > p.samples.j1 + kOnEdge;
    const double e = beyond ? p.error + p.rim : p.error;
    if (reads_[i]++ == 0) {
      touched_[touches_++] = i;
      sum_[i] = height[i] = bound[i] = worst_[i] = most_[i] = 0, low_[i] = INFINITY, high_[i] = -INFINITY;
      source[i] = 0, patch[i] = -1;
    }
    sum_[i] += w, height[i] += w * h, bound[i] += w * e;
    low_[i] = std::min(low_[i], h), high_[i] = std::max(high_[i], h), worst_[i] = std::max(worst_[i], e);
    if (named_ && w > most_[i]) {
      most_[i] = w, patch[i] = std::int32_t(place);
      source[i] = s.holes && !any_cell(s.holes->real, r.u[k], r.v[k]) ? -p.source : p.source;
    }
    if (priority) rest_[i] *= 1 - r.weight[k];
  }
}

void Batch::compose_inside(const Blend::Placed& p, std::uint32_t place, const PatchSurface& s,
                           int smoothness) {
  const std::size_t n = x.size();
  kernels::to_window(window_map(p), x.data(), y.data(), int(n), whole_.u.data(), whole_.v.data());
  kernels::interpolate(smoothness, s.codes.data(), whole_.u.data(), whole_.v.data(), int(n),
                       whole_.value.data());
  for (std::size_t k = 0; k < n; ++k) height[k] = p.quantum * (p.origin + whole_.value[k]) + p.base;
  std::fill_n(bound.begin(), n, p.error);
  if (named_) {
    std::fill_n(source.begin(), n, p.source);
    std::fill_n(patch.begin(), n, std::int32_t(place));
  }
  counts = {n, n, 1, p.error};
}

void Batch::compose(const Database& db, const std::vector<Blend::Placed>& placed,
                    const std::vector<std::uint32_t>& candidates, bool inside, bool named,
                    const BlendOptions& options) {
  const bool priority = options.composition == Composition::priority;
  named_ = named;
  if (inside && options.fast_path) {
    const std::uint32_t c = candidates.front();
    compose_inside(placed[c], c, surface(db, placed[c], c), options.smoothness);
    if (options.strict) withhold(options.error);
    return;
  }
  start();
  for (const std::uint32_t c : candidates) {
    if (left_ == 0) break;
    const Blend::Placed& p = placed[c];
    weigh(p, options);
    const bool may_settle = priority && options.fast_path && !p.ragged && p.kernel_is_sampled();
    may_settle ? split() : take_all();
    if (whole_.n + part_.n == 0) continue;
    const PatchSurface& s = surface(db, p, c);
    read(p, s, options.smoothness, whole_);
    settle(p, c);
    keep_floors(p, options);
    if (s.holes) fade_at_holes(*s.holes, options.smoothness);
    read(p, s, options.smoothness, part_);
    add(p, c, s, priority);
    if (priority && !may_settle) drop_settled();
  }
  finish();
  if (options.strict) withhold(options.error);
}

void Batch::start() {
  const std::size_t n = x.size();
  left_ = n, settled_ = touches_ = 0, counts = {n, 0, 0, 0};
  std::iota(left_at_.begin(), left_at_.begin() + std::ptrdiff_t(n), 0u);
  std::fill_n(rest_.begin(), n, 1.0);
  std::fill_n(reads_.begin(), n, 0u);
}

void Batch::finish() {
  for (std::size_t t = 0; t < touches_; ++t) {
    const std::uint32_t k = touched_[t];
    height[k] = std::clamp(height[k] / sum_[k], low_[k], high_[k]);
    bound[k] = std::min(bound[k] / sum_[k], worst_[k]);  // a mean of equal errors is that error
    counts.contributions += reads_[k], counts.most = std::max<std::uint64_t>(counts.most, reads_[k]);
    counts.bound_max = std::max(counts.bound_max, bound[k]);
  }
  if (settled_ + touches_ == counts.points) return;
  for (std::size_t k = 0; k < counts.points; ++k)
    if (reads_[k] == 0) forget(k);
}

// With `strict`: no data where the bound exceeds the error.
void Batch::withhold(double error) {
  counts.bound_max = 0;
  for (std::size_t k = 0; k < counts.points; ++k) {
    if (bound[k] > error) forget(k);
    if (bound[k] == bound[k]) counts.bound_max = std::max(counts.bound_max, bound[k]);
  }
}

void Batch::forget(std::size_t k) {
  height[k] = bound[k] = std::numeric_limits<double>::quiet_NaN(), source[k] = 0, patch[k] = -1;
}

}  // namespace patchwork
