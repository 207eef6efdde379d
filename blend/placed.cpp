#include "blend/placed.h"

#include <algorithm>
#include <cmath>

namespace patchwork {

namespace {

// Coordinates are compared with this much room (window cells), so that rounding decides nothing.
constexpr double kRoom = 1e-6;
LatticeRect to_window(const LatticeRect& r, const Blend::Placed& p, double scale) {
  return {r.i0 * scale - p.first_i, r.j0 * scale - p.first_j, r.i1 * scale - p.first_i,
          r.j1 * scale - p.first_j};
}

// Ramps end at the outer samples, so that the larger bound of what is extrapolated beyond them does not mix
// into the heights of other patches. A kernel that reaches them itself (2 samples) leaves no room for that.
LatticeRect ramp_of(const LatticeRect& kernel, const LatticeRect& domain, const LatticeRect& samples) {
  return {kernel.i0 > samples.i0 ? std::max(domain.i0, samples.i0) : domain.i0,
          kernel.j0 > samples.j0 ? std::max(domain.j0, samples.j0) : domain.j0,
          kernel.i1 < samples.i1 ? std::min(domain.i1, samples.i1) : domain.i1,
          kernel.j1 < samples.j1 ? std::min(domain.j1, samples.j1) : domain.j1};
}

}  // namespace

Blend::Placed place(const Database& db, PatchId id, int smoothness) {
  const Grid& g = db.grid(id.grid());
  const Frame& f = g.info.frame;
  const GridShape& shape = g.info.shape;
  Blend::Placed p{};
  const double scale = std::ldexp(1, -id.level());
  const auto& inverse = f.inverse();
  p.id = id, p.x0 = f.numbers()[0], p.y0 = f.numbers()[3];
  p.ua = inverse[0] * scale, p.ub = inverse[1] * scale, p.va = inverse[2] * scale, p.vb = inverse[3] * scale;
  p.first_i = id.bx() * kKernelCells - kExtensionCells - 1,
  p.first_j = id.by() * kKernelCells - kExtensionCells - 1;
  const LatticeRect domain = shape.domain(id.level(), id.bx(), id.by());
  p.kernel = to_window(shape.kernel(id.level(), id.bx(), id.by()), p, scale);
  p.domain = to_window(domain, p, scale);
  p.samples = to_window(shape.samples(), p, scale);
  p.ramp = ramp_of(p.kernel, p.domain, p.samples);
  p.has_rim = p.ramp.i0 > p.domain.i0 || p.ramp.j0 > p.domain.j0 || p.ramp.i1 < p.domain.i1 ||
              p.ramp.j1 < p.domain.j1;
  const PatchRecord record = db.patch(id);
  p.ragged = record.ragged();
  p.rim = g.info.rim_error;
  p.error = record.error[size_t(smoothness)];
  p.volume = 4 / (domain.area() * f.cell_area());
  p.quantum = g.info.quantum, p.base = g.info.base, p.origin = double(g.info.code_origin);
  p.source = std::int32_t(&g - db.grids().data()) + 1;
  p.bounds = f.bounds(domain);
  return p;
}

LatticeRect Blend::Placed::window_bounds(const Corners& corners) const {
  LatticeRect r = LatticeRect::nothing();
  for (const Point& c : corners) {
    const double dx = c.x - x0, dy = c.y - y0;
    r.add({(ua * dx + ub * dy) - first_i, (va * dx + vb * dy) - first_j});
  }
  return r;
}

Candidates filter(const std::vector<Blend::Placed>& placed, const Candidates& from, const Corners& corners,
                  bool priority, bool& inside) {
  Extent e = Extent::nothing();
  for (const Point& corner : corners) e.add(corner);
  Candidates kept;
  inside = false;
  for (const std::uint32_t c : from) {
    const Blend::Placed& p = placed[c];
    if (!p.bounds.meets(e)) continue;
    const LatticeRect w = p.window_bounds(corners);
    if (w.i1 < p.domain.i0 - kRoom || w.i0 > p.domain.i1 + kRoom || w.j1 < p.domain.j0 - kRoom ||
        w.j0 > p.domain.j1 + kRoom)
      continue;
    kept.push_back(c);
    const bool holds = w.i0 > p.kernel.i0 + kRoom && w.i1 < p.kernel.i1 - kRoom &&
                       w.j0 > p.kernel.j0 + kRoom && w.j1 < p.kernel.j1 - kRoom;
    if (priority && holds && !p.ragged) {
      inside = kept.size() == 1;
      break;
    }
  }
  return kept;
}

}  // namespace patchwork
