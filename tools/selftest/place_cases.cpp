// Cases that look at places where the formula of the surface changes: vertices, rims, holes, overlaps.
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/resampler.h"
#include "tools/selftest/selftest.h"

namespace patchwork::cli {

namespace {

constexpr double kPosition = 1e-6;  // cells: how exactly a place is met far from the origin (FarOrigin)

bool inside(const LatticeRect& r, double i, double j, double by) {
  return i > r.i0 + by && i < r.i1 - by && j > r.j0 + by && j < r.j1 - by;
}

// Heights of a row of samples, metres; NaN where there is no data.
std::vector<double> row_of(const Database& db, const Grid& g, int j) {
  std::vector<double> row(std::size_t(g.info.shape.width()));
  db.read_samples(g.info.id, j, 1, row);
  for (double& h : row) h = h * g.info.raw_scale + g.info.base;
  return row;
}

struct Rows {  // three neighbouring ones
  std::array<std::vector<double>, 3> at;
  Rows(const Database& db, const Grid& g, int j)
      : at{row_of(db, g, j - 1), row_of(db, g, j), row_of(db, g, j + 1)} {}
  // The largest step from sample i of the middle row to its neighbours; NaN next to a hole.
  double step(int i) const {
    double most = 0;
    for (const auto& row : at)
      for (int d = -1; d <= 1; ++d) {
        const double s = std::abs(row[std::size_t(i + d)] - at[1][std::size_t(i)]);
        if (!(s <= most)) most = s;
      }
    return most;
  }
};

// The patch that speaks alone at p, if it is one of level 0 of `g` with p well inside.
bool is_alone(const Database& db, const Grid& g, Point p, double i, double j) {
  for (const PatchId id : patches_at(db, p, 0)) {
    const Grid& of = db.grid(id.grid());
    const Point q = of.info.frame.to_lattice(p.x, p.y);
    if (!inside(of.info.shape.domain(id.level(), id.bx(), id.by()), q.x, q.y, -1e-3)) continue;
    return &of == &g && id.level() == 0 && !db.patch(id).ragged() &&
           inside(g.info.shape.kernel(0, id.bx(), id.by()), i, j, 0);
  }
  return false;
}

// A place on an edge of a rectangle, and the direction across it.
struct Crossing {
  Point at, across;
  double step;  // metres, the finest of the grids there
};

Crossing on_edge(Trial& t, const Grid& g, const LatticeRect& r) {
  const auto& n = g.info.frame.numbers();
  const double along = t.between(0.01, 0.99);
  const bool over_i = t.integer(0, 1) == 1, far = t.integer(0, 1) == 1;
  const Point at = over_i ? g.info.frame.to_domain(far ? r.i1 : r.i0, r.j0 + along * (r.j1 - r.j0))
                          : g.info.frame.to_domain(r.i0 + along * (r.i1 - r.i0), far ? r.j1 : r.j0);
  const double si = g.info.frame.step_i(), sj = g.info.frame.step_j();
  return {at, over_i ? Point{n[1] / si, n[4] / si} : Point{n[2] / sj, n[5] / sj},
          finest_step(t.db, {at.x, at.y, at.x, at.y})};
}

// Where two grids both end and none lies below, each speaks for its last half cell alone.
bool only_rims_meet(const Database& db, Point p) {
  int reached = 0;
  for (const Grid& g : db.grids()) {
    const GridShape& s = g.info.shape;
    const Point q = g.info.frame.to_lattice(p.x, p.y);
    if (inside(s.samples(), q.x, q.y, 0)) return false;
    reached += inside(s.footprint(), q.x, q.y, -1e-6);
  }
  return reached > 1;
}

// Largest jump over the crossings, `part` of a step on either side.
double largest_jump(const Database& db, const std::vector<PatchId>& patches, const BlendOptions& o,
                    const std::vector<Crossing>& crossings, double part) {
  Points points;
  for (const Crossing& c : crossings)
    for (const double side : {-0.5, 0.5}) {
      const double s = side * part * c.step;
      points.add({c.at.x + s * c.across.x, c.at.y + s * c.across.y});
    }
  const Heights h = heights_of(db, patches, points, o);
  double most = 0;
  for (std::size_t k = 0; k + 1 < points.size(); k += 2)
    if (const double jump = std::abs(h.height[k] - h.height[k + 1]); jump > most) most = jump;
  return most;
}

}  // namespace

Verdict source_exact(Trial& t) {
  Verdict v{
      "SourceExact", "a vertex where one patch speaks gives the stored value", 0, 0, kPosition, "cells", {}};
  for (int n = 0; n < std::max(20, t.options.tries / 200); ++n) {
    const Grid& g = t.any_grid();
    const GridShape& s = g.info.shape;
    if (s.width() < 20 || s.height() < 20) continue;
    const int j = t.integer(9, s.height() - 10);
    const Rows rows(t.db, g, j);
    Points points;
    std::vector<int> at;
    for (int m = 0; m < 20; ++m) {
      const int i = t.integer(9, s.width() - 10);
      const Point p = g.info.frame.to_domain(i, j);
      if (!std::isfinite(rows.step(i)) || !is_alone(t.db, g, p, i, j)) continue;
      points.add(p), at.push_back(i);
    }
    if (points.size() == 0) continue;
    const Extraction x = extract(
        t.db,
        {.error = 0, .region = Region::inside(g.info.frame.bounds({0, j - 1., s.width() - 1., j + 1.}))});
    for (int k = 0; k <= 2; ++k) {
      const Heights h = heights_of(t.db, x.patches, points, {.smoothness = k});
      for (std::size_t m = 0; m < at.size(); ++m) {
        const double stored = rows.at[1][std::size_t(at[m])], off = std::abs(h.height[m] - stored);
        const double rounding = 1e-12 * (1 + std::abs(stored)), step = rows.step(at[m]);
        if (off > rounding || std::isnan(off)) v.worst = std::max(v.worst, step > 0 ? off / step : INFINITY);
        ++v.tries;
      }
    }
  }
  if (v.tries == 0) v.left_out = "no vertex where one patch speaks alone was met";
  return v;
}

Verdict nodata_edges(Trial& t) {
  Verdict v{"NodataEdges",
            "every cell with data answers at every error, with a finite height",
            0,
            0,
            0,
            "points without",
            {}};
  Points points;
  for (int n = 0; n < std::max(20, t.options.tries / 100); ++n) {
    const Grid& g = t.any_grid();
    if (g.info.shape.width() < 3 || g.info.shape.height() < 3) continue;
    const int j = t.integer(1, g.info.shape.height() - 2);
    const Rows rows(t.db, g, j);
    for (int m = 0; m < 20; ++m) {
      const int i = t.integer(1, g.info.shape.width() - 2);
      if (!std::isfinite(rows.step(i))) continue;
      const double di = t.between(-1, 1);
      points.add(g.info.frame.to_domain(i + di, j + t.between(-1, 1)));
    }
  }
  for (const double error : t.errors) {
    const Extraction x = extract(t.db, {.error = error});
    for (const BlendOptions& o : all_blends()) {
      const Heights h = heights_of(t.db, x.patches, points, o);
      for (std::size_t k = 0; k < points.size(); ++k)
        v.worst += h.source[k] == 0 || !std::isfinite(h.height[k]) || !std::isfinite(h.bound[k]);
      v.tries += points.size();
    }
  }
  return v;
}

Verdict rim_weights(Trial& t) {
  Verdict v{"RimWeights",
            "just inside the rims heights are finite and between those of the patches",
            0,
            0,
            0,
            "points beyond",
            {}};
  Points points;
  for (int n = 0; n < std::max(40, t.options.tries / 100); ++n) {
    const Grid& g = t.any_grid();
    const LatticeRect f = g.info.shape.footprint();
    constexpr double parts[] = {0, 1e-14, 1e-11, 1e-8, 1e-6};
    const double in = parts[n % 5], along = n % 7 == 0 ? in : t.between(0.01, 0.99) * (f.j1 - f.j0);
    points.add(g.info.frame.to_domain(f.i0 + in, f.j0 + along)),
        points.add(g.info.frame.to_domain(f.i1 - in, f.j1 - along));
    points.add(g.info.frame.to_domain(f.i0 + std::min(along, f.i1 - f.i0), f.j0 + in));
  }
  for (const BlendOptions& o : all_blends())
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Point p{points.x[k], points.y[k]};
      Points one;
      one.add(p);
      const std::vector<PatchId> patches = patches_at(t.db, p, t.errors[k % t.errors.size()]);
      double low = INFINITY, high = -INFINITY;
      for (const PatchId id : patches) {
        const Heights alone = heights_of(t.db, std::span(&id, 1), one, o);
        if (alone.source[0] != 0)
          low = std::min(low, alone.height[0]), high = std::max(high, alone.height[0]);
      }
      const Heights h = heights_of(t.db, patches, one, o);
      ++v.tries;
      if (low > high)
        v.worst += h.source[0] != 0;
      else
        v.worst += !(h.height[0] >= low && h.height[0] <= high && std::isfinite(h.bound[0]));
    }
  return v;
}

Verdict continuity(Trial& t) {
  Verdict v{"ContinuityCk",
            "over kernel rims and domain rims a quarter of the step has a quarter of the jump",
            0,
            0,
            0.35,
            "of the jump",
            {}};
  for (const double error : {t.errors[0], t.errors[2], t.errors[4]}) {
    const std::vector<PatchId> patches = extract(t.db, {.error = error}).patches;
    std::vector<Crossing> crossings;
    for (int n = 0; n < t.options.tries / 4; ++n) {
      const PatchId id = patches[std::size_t(t.integer(0, int(patches.size()) - 1))];
      const Grid& g = t.db.grid(id.grid());
      const GridShape& s = g.info.shape;
      const LatticeRect r =
          n % 2 ? s.kernel(id.level(), id.bx(), id.by()) : s.domain(id.level(), id.bx(), id.by());
      const Crossing c = on_edge(t, g, r);
      if (!only_rims_meet(t.db, c.at)) crossings.push_back(c);
    }
    for (const BlendOptions& o : all_blends()) {
      const double wide = largest_jump(t.db, patches, o, crossings, 1.0 / 64),
                   narrow = largest_jump(t.db, patches, o, crossings, 1.0 / 256);
      if (wide > 1e-6) v.worst = std::max(v.worst, narrow / wide);
      v.tries += crossings.size();
    }
  }
  return v;
}

Verdict spline_stencil(Trial& t) {
  Verdict v{"SplineStencil",
            "neighbouring patches of a level agree where they overlap",
            0,
            0,
            kPosition,
            "of the relief",
            {}};
  for (int n = 0; n < std::max(20, t.options.tries / 100); ++n) {
    const Grid& g = t.any_grid();
    const GridShape& s = g.info.shape;
    const int level = t.integer(0, s.levels() - 1);
    if (s.blocks_i(level) < 2) continue;
    const int bx = t.integer(0, s.blocks_i(level) - 2), by = t.integer(0, s.blocks_j(level) - 1);
    const std::size_t left = s.index(level, bx, by), right = s.index(level, bx + 1, by);
    const auto whole = [&](std::size_t k) { return g.patches[k].exists() && !g.patches[k].ragged(); };
    if (!whole(left) || !whole(right)) continue;
    const LatticeRect a = s.domain(level, bx, by), b = s.domain(level, bx + 1, by);
    Points points;
    for (int k = 0; k < 20; ++k) {
      const double i = t.between(b.i0, a.i1);
      points.add(g.info.frame.to_domain(i, t.between(a.j0, a.j1)));
    }
    const PatchId ids[] = {g.patch_id(left), g.patch_id(right)};
    for (int k = 0; k <= 2; ++k) {
      const Heights p = heights_of(t.db, std::span(ids, 1), points, {.smoothness = k}),
                    q = heights_of(t.db, std::span(ids + 1, 1), points, {.smoothness = k});
      for (std::size_t m = 0; m < points.size(); ++m) {
        if (p.source[m] == 0 || q.source[m] == 0) continue;  // on the very rim
        const double off = std::abs(p.height[m] - q.height[m]);
        v.worst = std::max(
            v.worst, std::isfinite(off) ? off / std::max(1e-3, g.info.highest - g.info.lowest) : INFINITY);
        ++v.tries;
      }
    }
  }
  if (v.tries == 0) v.left_out = "no grid has two neighbouring patches without holes";
  return v;
}

}  // namespace patchwork::cli
