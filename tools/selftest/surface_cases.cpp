// Cases that evaluate the surface at many points: bounds, orders of summation, both engines.
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "blend/vulkan/vulkan_blend.h"
#include "db/error.h"
#include "tools/selftest/selftest.h"

namespace patchwork::cli {

namespace {

// Kernels that cover are grown by 1/1024 of a cell: in such a hairline a ramp is that far from 1.
constexpr double kHairline = 1.0 / 512;
constexpr double kRounding = 1e-9;  // metres, and of the height

// Somewhere over the terrain, looking somewhere.
ViewCut any_view(Trial& t) {
  const Extent e = t.db.extent();
  const HeightRange heights = t.db.heights();
  const double side = std::min(e.xmax - e.xmin, e.ymax - e.ymin);
  const auto place = [&](double z) {
    const double x = t.between(e.xmin, e.xmax);
    return Point3{x, t.between(e.ymin, e.ymax), z};
  };
  const Point3 eye = place(heights.highest + t.between(0.001, 0.3) * side);
  return over_terrain_of(t.db, {.eye = eye,
                                .look = place(heights.lowest),
                                .fov_degrees = t.between(20, 80),
                                .pixel_error = std::exp2(t.between(0, 6))});
}

// Does a patch of the answer that is that accurate offer its kernel at p?
bool offers(const Database& db, Point p, double error) {
  for (const PatchId id : patches_at(db, p, error)) {
    const Grid& g = db.grid(id.grid());
    const PatchRecord r = db.patch(id);
    const Point q = g.info.frame.to_lattice(p.x, p.y);
    const LatticeRect k = g.info.shape.kernel(id.level(), id.bx(), id.by());
    if (!r.ragged() && r.bottom <= error && r.error[0] <= error && q.x > k.i0 && q.x < k.i1 && q.y > k.j0 &&
        q.y < k.j1)
      return true;
  }
  return false;
}

// The largest part of what both bounds allow by which heights depart from the best.
double worst_part(const Heights& h, const Heights& best) {
  double worst = 0;
  for (std::size_t k = 0; k < h.height.size(); ++k) {
    if (best.source[k] == 0) continue;
    if (h.source[k] == 0 || !std::isfinite(h.height[k]) || !std::isfinite(h.bound[k])) return INFINITY;
    const double allowed = h.bound[k] + best.bound[k] + kRounding * (1 + std::abs(best.height[k]));
    worst = std::max(worst, std::abs(h.height[k] - best.height[k]) / allowed);
  }
  return worst;
}

Heights pixels_of(const Evaluator& surface, const RasterFrame& raster, int side) {
  const std::size_t n = std::size_t(side) * std::size_t(side);
  Heights h{std::vector<double>(n), std::vector<double>(n), std::vector<std::int32_t>(n)};
  surface.at_pixels(raster, side, 0, side,
                    {.height = h.height, .bound = h.bound, .source = h.source, .patch = {}});
  return h;
}

// Of the limit that the graphics card keeps to (blend/vulkan/vulkan_blend.h).
double worst_difference(const Heights& cpu, const Heights& card) {
  double worst = 0;
  for (std::size_t k = 0; k < cpu.height.size(); ++k) {
    if ((cpu.source[k] == 0) != (card.source[k] == 0)) return INFINITY;
    if (cpu.source[k] == 0) continue;
    if (!std::isfinite(card.height[k]) || !std::isfinite(card.bound[k])) return INFINITY;
    const double limit = VulkanBlend::departure(cpu.height[k]);
    worst =
        std::max({worst, std::abs(cpu.height[k] - card.height[k]) / limit,
                  std::abs(cpu.bound[k] + VulkanBlend::departure(card.height[k]) - card.bound[k]) / limit});
  }
  return worst;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

}  // namespace

Verdict bound_holds(Trial& t) {
  Verdict v{"BoundHolds",
            "no height is farther from the best than both bounds allow",
            0,
            0,
            1,
            "of the bounds",
            {}};
  const Points points = points_in(t, t.db.extent(), t.options.tries);
  const Heights best = heights_of(t.db, extract(t.db, {.error = 0}).patches, points);
  for (const double error : t.errors) {
    const Extraction x = extract(t.db, {.error = error});
    for (const BlendOptions& o : all_blends()) {
      v.worst = std::max(v.worst, worst_part(heights_of(t.db, x.patches, points, o), best));
      v.tries += points.size();
    }
  }
  return v;
}

Verdict bound_is_what_was_asked(Trial& t) {
  Verdict v{"BoundHolds, asked",
            "where a kernel offers the error, the bound keeps to it",
            0,
            0,
            1,
            "of the error",
            {}};
  const int each = std::max(1, t.options.tries / 20);
  for (int n = 0; n < 10; ++n) {
    const Points points = points_in(t, t.db.extent(), each);
    const ViewCut view = any_view(t);
    const bool uniform = n % 2 == 0;
    const double error = t.errors[1 + std::size_t(n / 2) % (t.errors.size() - 1)];
    const auto cut = uniform ? make_surface(UniformCut{.error = error}) : make_surface(view);
    const Extraction x = extract(t.db, *cut);
    if (x.patches.empty()) continue;
    const std::vector<Point> seen = uniform ? std::vector<Point>() : footprint(view);
    const Heights h = heights_of(t.db, x.patches, points);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Point p{points.x[k], points.y[k]};
      const double asked = cut->at(p);
      if ((!uniform && !sees(seen, p)) || !(asked > 0) || !offers(t.db, p, asked)) continue;
      ++v.tries;
      const double part = (h.bound[k] - kHairline * x.bound_max) / asked;
      v.worst = std::max(v.worst, std::isnan(part) ? INFINITY : part);  // no answer at all
    }
  }
  if (v.tries == 0) v.left_out = "no point was met where a kernel offers what was asked";
  return v;
}

Verdict summation_order(Trial& t) {
  Verdict v{"SummationOrder",
            "the same bits on one thread and on all, in any order of points",
            0,
            0,
            0,
            "of 12 differ",
            {}};
  const Points points = points_in(t, t.db.extent(), t.options.tries);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), t.random);
  Points shuffled;
  for (const std::size_t k : order) shuffled.add({points.x[k], points.y[k]});
  const Extraction x = extract(t.db, {.error = t.errors[t.errors.size() / 2]});
  for (const BlendOptions& o : all_blends()) {
    const Heights all = heights_of(t.db, x.patches, points, o),
                  other = heights_of(t.db, x.patches, shuffled, o);
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    const Heights one = heights_of(t.db, x.patches, points, o);
    std::vector<double> back(points.size());
    for (std::size_t k = 0; k < order.size(); ++k) back[order[k]] = other.height[k];
    v.worst += !same_bits(all.height, one.height) + !same_bits(all.height, back);
    v.tries += 2 * points.size();
  }
  return v;
}

Verdict cpu_gpu_parity(Trial& t) {
  Verdict v{"CpuGpuParity",
            "the graphics card differs by at most 1 mm + 1e-6 of the height",
            0,
            0,
            1,
            "of the limit",
            {}};
  std::shared_ptr<Device> device;
  try {
    device = Device::open();
  } catch (const Error& e) {
    v.left_out = e.what();
    return v;
  }
  const Extent e = t.db.extent();
  const int side = std::max(16, int(std::sqrt(double(t.options.tries) / 12)));
  const double dx = (e.xmax - e.xmin) / side, dy = (e.ymax - e.ymin) / side;
  const RasterFrame raster{e.xmin + t.between(0, 1) * dx, dx, 0, e.ymax - t.between(0, 1) * dy, 0, -dy};
  for (const double error : {t.errors[0], t.errors[t.errors.size() / 2]}) {
    const Extraction x = extract(t.db, {.error = error});
    for (const BlendOptions& o : all_blends()) {
      const VulkanBlend on_card(device, t.db, x.patches, o, {.memory = std::size_t(t.options.memory / 4)});
      const Heights cpu = pixels_of(Blend(t.db, x.patches, o), raster, side),
                    card = pixels_of(on_card, raster, side);
      v.tries += cpu.height.size();
      v.worst = std::max(v.worst, worst_difference(cpu, card));
    }
  }
  return v;
}

}  // namespace patchwork::cli
