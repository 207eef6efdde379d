// What tests ask of whole databases: stored heights, equality of everything that is stored, counts.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "db/database.h"

namespace patchwork {

template <class Visit>
void each_patch(const Grid& g, Visit visit) {
  for (std::size_t k = 0; k < g.patches.size(); ++k)
    if (g.patches[k].exists()) visit(k, g.info.shape.block(k));
}

inline std::size_t count_live(const Database& db) {
  std::size_t n = 0;
  for (const Grid& g : db.grids()) each_patch(g, [&](std::size_t k, auto) { n += !g.patches[k].dormant(); });
  return n;
}

inline const Grid& grid_named(const Database& db, const std::string& name) {
  for (const Grid& g : db.grids())
    if (g.info.name == name) return g;
  throw std::logic_error("no grid " + name);
}

/// The stored height of sample (i, j) of a grid without holes, as a level-0 patch gives it out.
inline double stored_height(const Database& db, const Grid& g, int i, int j) {
  const int bx = std::min(i / kKernelCells, g.info.shape.blocks_i(0) - 1);
  const int by = std::min(j / kKernelCells, g.info.shape.blocks_j(0) - 1);
  const auto s = db.surface(PatchId::make(g.info.id, 0, bx, by));
  return g.info.height(s->codes[size_t((j - int(s->first_j)) * PatchSurface::kSide + i - int(s->first_i))]);
}

inline bool same_holes(const PatchSurface& a, const PatchSurface& b) {
  if (!a.holes || !b.holes) return !a.holes && !b.holes;
  return a.holes->answering == b.holes->answering && a.holes->real == b.holes->real &&
         a.holes->near == b.holes->near && a.holes->wide == b.holes->wide;
}

/// Patches of two grids whose samples or holes differ.
inline int different_surfaces(const Database& a, const Grid& ga, const Database& b, const Grid& gb) {
  int n = 0;
  each_patch(ga, [&](std::size_t k, auto) {
    const auto sa = a.surface(ga.patch_id(k)), sb = b.surface(gb.patch_id(k));
    n += sa->codes != sb->codes || !same_holes(*sa, *sb);
  });
  return n;
}

}  // namespace patchwork
