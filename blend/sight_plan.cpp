#include "blend/sight_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace patchwork {

namespace {

constexpr double kSameParameter = 1e-13;
constexpr int kSmoothPoints = 3, kBlendedPoints = 4;  // within a cell, to begin with
constexpr double kRimHair = 1e-7;  // cells inside a patch's rim: on it rounding decides which side answers

std::vector<Blend::Placed> place_all(const Database& db, std::span<const PatchId> patches, int smoothness) {
  std::vector<Blend::Placed> placed;
  placed.reserve(patches.size());
  for (const PatchId id : patches) placed.push_back(place(db, id, smoothness));
  return placed;
}

}  // namespace

// A ray over the window of a patch: (u, v) + t (du, dv).
struct SightPlanner::Projected {
  const Blend::Placed& p;
  double u, v, du, dv;

  Projected(const Blend::Placed& patch, const SightPath& path) : p(patch) {
    const double px = path.x0 - p.x0, py = path.y0 - p.y0;
    u = p.ua * px + p.ub * py - p.first_i, v = p.va * px + p.vb * py - p.first_j;
    du = p.ua * path.dx + p.ub * path.dy, dv = p.va * path.dx + p.vb * path.dy;
  }
  SightInterval within(const LatticeRect& r) const {
    SightInterval over;
    over.clip(u, du, r.i0, r.i1), over.clip(v, dv, r.j0, r.j1);
    return over;
  }
};

// A block of a patch that can come near the ray.
struct SightPlanner::Part {
  std::size_t patch;
  SightInterval over;
  double below;  // metres: the ray's lowest height over the largest of the surface
  SightInterval kernel;
};

SightPlanner::SightPlanner(const Database& db, std::span<const PatchId> patches, const BlendOptions& options)
    : options_(options),
      placed_(place_all(db, patches, options.smoothness)),
      heights_(db, placed_, options.smoothness) {
  for (const Blend::Placed& p : placed_) {
    largest_bound_ = std::max(largest_bound_, p.error + p.rim);
    finest_cell_ = std::min(finest_cell_, 1 / std::sqrt(std::abs(p.ua * p.vb - p.ub * p.va)));
  }
}

// Blocks over which the ray is less than `threshold` (which may fall meanwhile) above the largest height:
// take(projected, part).
template <class Take>
void SightPlanner::visit_parts(const SightPath& path, const double& threshold, Take take) const {
  const auto below = [&](const SightInterval& over, double height) {
    return path.lowest(over.low, over.high) - height;
  };
  heights_.visit(
      [&](const Extent& e, double height) {
        SightInterval over;
        over.clip(path.x0, path.dx, e.xmin, e.xmax);
        over.clip(path.y0, path.dy, e.ymin, e.ymax);
        return !over.empty() && below(over, height) < threshold;
      },
      [&](std::size_t k) {
        const Projected on(placed_[k], path);
        const SightInterval domain = on.within(placed_[k].domain);
        if (domain.empty()) return;
        const SightInterval kernel = on.within(placed_[k].kernel);
        for (int j = 0; j < HeightTree::kBlocks; ++j) {
          SightInterval row = domain;
          row.clip(on.v, on.dv, HeightTree::block(0, j).j0, HeightTree::block(0, j).j1);
          for (int i = 0; i < HeightTree::kBlocks && !row.empty(); ++i) {
            Part part{k, row, 0, kernel};
            part.over.clip(on.u, on.du, HeightTree::block(i, 0).i0, HeightTree::block(i, 0).i1);
            if (part.over.empty()) continue;
            part.below = below(part.over, double(heights_.highest(k, i, j)));
            if (part.below < threshold) take(on, part);
          }
        }
      });
}

double SightPlanner::likely(const SightPath& path) const {
  double least = INFINITY, at = 0;
  visit_parts(path, least, [&](const Projected&, const Part& part) {
    least = part.below, at = 0.5 * (part.over.low + part.over.high);
  });
  return at;
}

// Parameters within the part at which the ray crosses lines where the patch, or its weight, changes its
// shape: of cells, of the kernel, of the ramp's end; and just inside the domain's rim.
void SightPlanner::add_lines(const Projected& on, const Part& part, std::vector<double>& t) const {
  const SightInterval& over = part.over;
  const auto add = [&](double at, double rate, double line) {
    const double crossing = (line - at) / rate;
    if (crossing > over.low && crossing < over.high) t.push_back(crossing);
  };
  const auto add_axis = [&](double at, double rate, const double(&others)[6]) {
    if (rate == 0) return;
    const double a = at + rate * over.low, b = at + rate * over.high;
    for (double line = std::ceil(std::min(a, b)); line <= std::max(a, b); ++line) add(at, rate, line);
    for (const double line : others) add(at, rate, line);
  };
  const LatticeRect &k = on.p.kernel, &r = on.p.ramp, &d = on.p.domain;
  add_axis(on.u, on.du, {k.i0, k.i1, r.i0, r.i1, d.i0 + kRimHair, d.i1 - kRimHair});
  add_axis(on.v, on.dv, {k.j0, k.j1, r.j0, r.j1, d.j0 + kRimHair, d.j1 - kRimHair});
  t.push_back(over.low), t.push_back(over.high);
}

// Within a cell of one bilinear patch the surface along a ray is a parabola, and one point between tells it;
// where patches are blended, and where they are smooth, it is a polynomial of higher degree.
void SightPlanner::add_between(const std::vector<Part>& active, double low, double high, Plan& plan) const {
  const double middle = 0.5 * (low + high);
  const Part* first = nullptr;
  for (const Part& p : active)
    if (p.over.low <= middle && middle <= p.over.high && (!first || p.patch < first->patch)) first = &p;
  const bool alone = first && options_.composition == Composition::priority &&
                     !placed_[first->patch].ragged && first->kernel.low <= middle &&
                     middle <= first->kernel.high;
  const bool exact = alone && options_.smoothness == 0;
  const int points = exact ? 1 : alone ? kSmoothPoints : kBlendedPoints;
  for (int b = 1; b <= points; ++b)
    plan.add(low + (high - low) * b / (points + 1), exact ? SightPlace::parabola : SightPlace::curve);
}

// What lies too far below to come near the ray still answers, and takes its weight from what does come near:
// the patches whose domains the ray crosses within `parts`, and where they begin to speak, change what they
// say in company of others, and end.
std::vector<SightPlanner::Part> SightPlanner::speakers(const SightPath& path, const std::vector<Part>& parts,
                                                       std::vector<double>& t) const {
  std::vector<SightInterval> near;  // apart, ascending
  for (const Part& p : parts) {
    if (near.empty() || p.over.low > near.back().high) near.push_back(p.over);
    near.back().high = std::max(near.back().high, p.over.high);
  }
  std::vector<Part> all;
  const auto each_overlap = [&](const SightInterval& over, auto take) {
    const auto from = std::partition_point(near.begin(), near.end(),
                                           [&](const SightInterval& n) { return n.high < over.low; });
    for (auto n = from; n != near.end() && n->low <= over.high; ++n)
      take(SightInterval{std::max(n->low, over.low), std::min(n->high, over.high)});
  };
  heights_.visit(
      [&](const Extent& e, double) {
        SightInterval over;
        over.clip(path.x0, path.dx, e.xmin, e.xmax);
        over.clip(path.y0, path.dy, e.ymin, e.ymax);
        bool meets = false;
        if (!over.empty()) each_overlap(over, [&](const SightInterval&) { meets = true; });
        return meets;
      },
      [&](std::size_t k) {
        const Projected on(placed_[k], path);
        const SightInterval domain = on.within(placed_[k].domain), kernel = on.within(placed_[k].kernel);
        if (domain.empty()) return;
        const auto add = [&](const SightInterval& over) {
          if (!over.empty()) add_lines(on, {k, over, 0, kernel}, t);
        };
        each_overlap(domain, [&](const SightInterval& over) {
          all.push_back({k, over, 0, kernel});
          if (kernel.empty() || placed_[k].ragged || options_.composition != Composition::priority)
            return add(over);
          add({over.low, std::min(over.high, kernel.low)}), add({std::max(over.low, kernel.high), over.high});
        });
      });
  std::sort(all.begin(), all.end(), [](const Part& a, const Part& b) { return a.over.low < b.over.low; });
  return all;
}

SightPlanner::Plan SightPlanner::plan(const SightPath& path, double threshold) const {
  std::vector<Part> parts, active;
  std::vector<double> t;
  visit_parts(path, threshold, [&](const Projected& on, const Part& part) {
    parts.push_back(part);
    add_lines(on, part, t);
  });
  std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.over.low < b.over.low; });
  const std::vector<Part> speaking = speakers(path, parts, t);
  std::sort(t.begin(), t.end());
  t.erase(std::unique(t.begin(), t.end(), [](double a, double b) { return b - a < kSameParameter; }),
          t.end());
  Plan plan;
  std::size_t part = 0, speaker = 0;
  double reach = -1;  // up to here the parts so far go without a gap
  for (std::size_t k = 0; k < t.size(); ++k) {
    const bool joined = k > 0 && t[k] <= reach + kSameParameter;
    if (joined) add_between(active, t[k - 1], t[k], plan);
    plan.add(t[k], joined ? SightPlace::line : SightPlace::begins);
    std::erase_if(active, [&](const Part& p) { return p.over.high <= t[k]; });
    for (; part < parts.size() && parts[part].over.low <= t[k] + kSameParameter; ++part)
      reach = std::max(reach, parts[part].over.high);
    for (; speaker < speaking.size() && speaking[speaker].over.low <= t[k] + kSameParameter; ++speaker)
      active.push_back(speaking[speaker]);
  }
  return plan;
}

}  // namespace patchwork
