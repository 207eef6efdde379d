// Tops and best flags by the formulas of the model (section 3), word by word: every patch is a candidate.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "db/coverage.h"
#include "db/invariant.h"
#include "tests/db/databases.h"

namespace patchwork::model {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Candidate {
  double bottom;
  std::vector<OrientedRect> rects;
};

inline LatticeRect grown(LatticeRect r, int level) {
  const double by = std::ldexp(1.0 / 1024, level);
  return {r.i0 - by, r.j0 - by, r.i1 + by, r.j1 + by};
}

// What patch k of `g` covers: its kernel towards its own grid, towards others only what it offers.
inline std::vector<OrientedRect> cover_of(const Grid& g, std::size_t k, bool own) {
  const GridShape::Block b = g.info.shape.block(k);
  const LatticeRect kernel = g.info.shape.kernel(b.level, b.bx, b.by);
  if (own || !g.patches[k].ragged()) return {{&g.info.frame, grown(kernel, b.level)}};
  std::vector<OrientedRect> rects;
  if (const Offer* const o = g.patches.offer(k))
    for (std::uint32_t c = 0; c < o->count; ++c) {
      const double step = std::ldexp(1, b.level), i = b.bx * kKernelCells * step,
                   j = b.by * kKernelCells * step;
      const auto& [i0, j0, i1, j1] = o->cells[c];
      const LatticeRect r{std::max(kernel.i0, i + i0 * step), std::max(kernel.j0, j + j0 * step),
                          std::min(kernel.i1, i + i1 * step), std::min(kernel.j1, j + j1 * step)};
      if (!r.empty()) rects.push_back({&g.info.frame, grown(r, b.level)});
    }
  return rects;
}

/// min { z : kernel(p) is covered by the candidates with bottom <= z }.
inline double smallest_z(std::span<const Grid> grids, PatchPlace p, std::vector<Candidate> candidates) {
  const Grid& g = grids[p.grid];
  const GridShape::Block b = g.info.shape.block(p.index);
  const OrientedRect target{&g.info.frame, g.info.shape.kernel(b.level, b.bx, b.by)};
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& x, const Candidate& y) { return x.bottom < y.bottom; });
  std::vector<OrientedRect> rects;
  CoverageCounts counts;
  for (const Candidate& c : candidates) {
    rects.insert(rects.end(), c.rects.begin(), c.rects.end());
    if (covered(target, rects, counts)) return c.bottom;
  }
  return kInfinity;
}

template <class Admit>
std::vector<Candidate> candidates(std::span<const Grid> grids, PatchPlace p, Admit admit) {
  std::vector<Candidate> all;
  for (std::size_t g = 0; g < grids.size(); ++g)
    each_patch(grids[g], [&](std::size_t k, auto) {
      if (g == p.grid && k == p.index) return;
      if (admit(grids[g], k)) all.push_back({grids[g].patches[k].bottom, cover_of(grids[g], k, g == p.grid)});
    });
  return all;
}

inline double top(std::span<const Grid> grids, PatchPlace p, bool by_order = true) {
  CoverageCounts counts;
  return smallest_z(grids, p, candidates(grids, p, [&](const Grid& g, std::size_t k) {
                      return !by_order || less(grids[p.grid], p.index, g, k, counts);
                    }));
}

inline bool best(std::span<const Grid> grids, PatchPlace p) {
  CoverageCounts counts;
  const Grid& own = grids[p.grid];
  const double bottom = own.patches[p.index].bottom;
  auto better = candidates(grids, p, [&](const Grid& g, std::size_t k) {
    const double z = g.patches[k].bottom;
    return z < bottom || (z == bottom && less(own, p.index, g, k, counts));
  });
  // Where a finer block of the own grid is absent its cells hold no data: to know that is better.
  for (std::size_t k = 0; k < own.patches.size(); ++k)
    if (!own.patches[k].exists() && own.info.shape.block(k).level < own.info.shape.block(p.index).level)
      better.push_back({0, cover_of(own, k, true)});
  return smallest_z(grids, p, better) == kInfinity;
}

}  // namespace patchwork::model
