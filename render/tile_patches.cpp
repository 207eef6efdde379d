#include "render/tile_patches.h"

#include <algorithm>
#include <cmath>

#include "db/float_rounding.h"
#include "render/tile_cut.h"

namespace patchwork {

namespace {

// At most what a grid's samples may be off where a patch lies, metres: what the error of its first patch of
// level 0 is.
double floor_under(const Grid& grid, int level, int bx, int by) {
  const PatchRecord finest = grid.at(0, bx << level, by << level);
  return finest.exists() ? finest.error[0] : 0;
}

// A patch with cells smaller than the distance of samples may stick out between these by as much as it
// departs from the patch of its own grid that they do resolve, twice: up here, down there.
double missed(const Grid& grid, const PatchId& id, double spacing) {
  const double step = grid.info.frame.finer_step();
  int level = id.level(), bx = id.bx(), by = id.by();
  const auto resolved = [&] { return std::ldexp(step, level) >= spacing * 0.99; };
  if (resolved()) return 0;
  const auto departure = [&] {
    const PatchRecord p = grid.at(level, bx, by);
    return p.exists() ? p.bottom - floor_under(grid, level, bx, by) : 0;
  };
  double most = departure();
  while (!resolved() && level + 1 < grid.info.shape.levels()) {
    ++level, bx >>= 1, by >>= 1;
    most = std::max(most, departure());
  }
  return 2 * std::max(0.0, most);
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
  const bool exact = lattice.error(tile.level) == 0;
  constexpr float kAll = std::numeric_limits<float>::infinity();
  bool best = true;
  {
    const Database::Reading reading = db.reading();
    for (const Blend::Placed& p : placed) {
      if (!p.bounds.meets(all)) continue;
      const Grid& grid = db.grid(p.id.grid());
      const int level = p.id.level(), bx = p.id.bx(), by = p.id.by();
      ++t.patches, t.heights.add(grid.info.surface_heights());
      best = best && grid.at(level, bx, by).best();
      const float more = float_at_least(missed(grid, p.id, spacing));
      const float lasting = exact ? kAll : float_at_most(floor_under(grid, level, bx, by));
      blocks_in(p.bounds, own).each([&](std::size_t b) {
        Block& block = t.blocks[b];
        block.lasting = block.reached() ? std::min(block.lasting, lasting) : lasting;
        block.unsampled = std::max(block.unsampled, more);
      });
    }
  }
  if (exact) return t;
  if (best && !is_improvable(db, ids, all)) {
    for (Block& b : t.blocks) b.lasting = kAll;
    return t;
  }
  // Where there are several grids, the best surface may be another one's.
  std::array<int, kBlocks * kBlocks> grids{};
  for (const Grid& grid : db.grids())
    if (const Extent e = grid.info.bounds(); e.meets(own))
      blocks_in(e, own).each([&](std::size_t b) {
        if (++grids[b] > 1) t.blocks[b].lasting = 0;
      });
  return t;
}

void TilePatches::prefetch(const Database& db, const std::vector<PatchId>& ids, const TileLattice& lattice,
                           const TileKey& tile) {
  const bool exact = lattice.error(tile.level) == 0;
  {
    const Database::Reading reading = db.reading();
    for (const PatchId id : ids) {
      const Grid& grid = db.grid(id.grid());
      missed(grid, id, 0.5 * lattice.step(tile.level));
      if (!exact) floor_under(grid, id.level(), id.bx(), id.by());
    }
  }
  if (!exact) is_improvable(db, ids, with_halo(lattice, tile));
}

}  // namespace patchwork
