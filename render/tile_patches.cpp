#include "render/tile_patches.h"

#include <algorithm>
#include <cmath>

#include "db/float_rounding.h"
#include "render/tile_cut.h"

namespace patchwork {

namespace {

// A patch with cells smaller than the distance of samples may stick out between these by as much as it
// departs from the patch of its own grid that they do resolve, twice: up here, down there.
double missed(const Grid& grid, const PatchId& id, double spacing) {
  const double step = grid.info.frame.finer_step();
  int level = id.level(), bx = id.bx(), by = id.by();
  if (std::ldexp(step, level) >= spacing * 0.99) return 0;
  double bottom = grid.at(level, bx, by).bottom;
  while (std::ldexp(step, level) < spacing * 0.99 && level + 1 < grid.info.shape.levels()) {
    ++level, bx >>= 1, by >>= 1;
    const PatchRecord p = grid.at(level, bx, by);
    if (p.exists()) bottom = std::max(bottom, p.bottom);
  }
  return 2 * std::max(0.0, bottom - grid.info.accuracy);
}

// The blocks of a tile that an extent covers a part of; not those that it only touches.
struct Blocks {
  int columns[2], rows[2];  // from the first to one past the last
  template <typename Work>
  void each(const Work& work) const {
    for (int r = rows[0]; r < rows[1]; ++r)
      for (int c = columns[0]; c < columns[1]; ++c) work(std::size_t(r * TilePatches::kBlocks + c));
  }
};

Blocks blocks_in(const Extent& e, const Extent& tile) {
  constexpr double kBlocks = TilePatches::kBlocks, kRounding = 1e-7;
  const double side = (tile.xmax - tile.xmin) / kBlocks;
  const auto first = [&](double v) { return int(std::clamp(v / side + kRounding, 0.0, kBlocks)); };
  const auto past = [&](double v) { return int(std::clamp(v / side - kRounding + 1, 0.0, kBlocks)); };
  return {{first(e.xmin - tile.xmin), past(e.xmax - tile.xmin)},
          {first(e.ymin - tile.ymin), past(e.ymax - tile.ymin)}};
}

}  // namespace

Extent with_halo(const TileLattice& lattice, const TileKey& tile) {
  const Extent e = lattice.bounds(tile);
  const double halo = lattice.step(tile.level);
  return {e.xmin - halo, e.ymin - halo, e.xmax + halo, e.ymax + halo};
}

TilePatches TilePatches::of(const Database& db, std::span<const Blend::Placed> placed,
                            const std::vector<PatchId>& ids, const TileLattice& lattice,
                            const TileKey& tile) {
  TilePatches t;
  const Extent own = lattice.bounds(tile), all = with_halo(lattice, tile);
  const double spacing = 0.5 * lattice.step(tile.level);
  bool best = true;
  const Database::Reading reading = db.reading();
  for (const Blend::Placed& p : placed) {
    if (!p.bounds.meets(all)) continue;
    const Grid& grid = db.grid(p.id.grid());
    ++t.patches, t.heights.add(grid.info.surface_heights());
    best = best && grid.at(p.id.level(), p.id.bx(), p.id.by()).best();
    const float more = float_at_least(missed(grid, p.id, spacing));
    blocks_in(p.bounds, own).each([&](std::size_t b) {
      t.blocks[b].unsampled = std::max(t.blocks[b].unsampled, more);
    });
  }
  if (lattice.error(tile.level) == 0 || (best && !is_improvable(db, ids, all))) {
    for (Block& b : t.blocks) b.lasting = std::numeric_limits<float>::infinity();
    return t;
  }
  // Where there are several grids, the best surface may be another one's.
  std::array<int, kBlocks * kBlocks> grids{};
  for (const Grid& grid : db.grids()) {
    const Extent e = grid.info.bounds();
    if (!e.meets(own)) continue;
    const float lasting = float_at_most(grid.info.accuracy + grid.info.quantisation);
    blocks_in(e, own).each([&](std::size_t b) { t.blocks[b].lasting = grids[b]++ == 0 ? lasting : 0; });
  }
  return t;
}

void TilePatches::prefetch(const Database& db, const std::vector<PatchId>& ids, const TileLattice& lattice,
                           const TileKey& tile) {
  const Database::Reading reading = db.reading();
  for (const PatchId id : ids) missed(db.grid(id.grid()), id, 0.5 * lattice.step(tile.level));
  if (lattice.error(tile.level) > 0) is_improvable(db, ids, with_halo(lattice, tile));
}

}  // namespace patchwork
