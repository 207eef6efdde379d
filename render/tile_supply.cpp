#include "render/tile_supply.h"

#include <algorithm>

#include "db/stopwatch.h"
#include "render/vulkan/tile_store_impl.h"

namespace patchwork {

namespace {

void note_made(const TileMakerCounts& before, const TileMakerCounts& after, FrameStats& stats) {
  stats.tiles_made = after.tiles - before.tiles, stats.patches_sent = after.patches - before.patches;
  stats.bytes_up = after.bytes - before.bytes, stats.dispatches = after.dispatches - before.dispatches;
  stats.extract_ms = after.extract_ms - before.extract_ms, stats.send_ms = after.send_ms - before.send_ms;
  stats.blend_ms = after.blend_ms - before.blend_ms, stats.finish_ms = after.finish_ms - before.finish_ms;
  stats.blended = after.blended;
  stats.blocks = {after.blocks.out - before.blocks.out, after.blocks.inside - before.blocks.inside,
                  after.blocks.partial - before.blocks.partial};
  stats.blended.points -= before.blended.points;
  stats.blended.contributions -= before.blended.contributions;
}

HeightRange heights_of(const Database& db) {
  HeightRange all;
  for (const Grid& g : db.grids()) all.add(g.info.surface_heights());
  return all;
}

}  // namespace

TileSupply::TileSupply(std::shared_ptr<Device> device, const Database& db, const TileLattice& lattice,
                       vk::TileStore& store, double base, const RendererOptions& options)
    : db_(db),
      lattice_(lattice),
      options_(options),
      heights_(heights_of(db)),
      cache_(store.slots, options.policy),
      maker_(std::move(device), db, lattice, store, base,
             {.smoothness = options.smoothness, .composition = options.composition}, options.memory / 2,
             options.tessellation == Tessellation::published),
      most_tiles_(store.slots * 2 / 3) {
  if (options.realtime)
    fetcher_ = std::make_unique<TileFetcher>(
        options.workers, [&db, &lattice](const TileKey& k) { TileMaker::prefetch(db, lattice, k); });
}

void TileSupply::select(const Frustum& frustum, FrameStats& stats) {
  const Stopwatch watch;
  select_tiles(lattice_, frustum, {options_.pixel_error, most_tiles_, cache_.slots(), heights_}, cache_,
               selection_);
  wanted_.clear();
  for (const Selection::Wanted& w : selection_.wanted) wanted_.push_back(w.key);
  stats.select_ms += watch.milliseconds();
}

// Half of the slots that can be had, four at least (a tile's children): what turns out to be wanted more once
// these are there would take the rest away again.
std::size_t TileSupply::most_at_a_time() const { return std::max<std::size_t>(4, cache_.room() / 2); }

// Of the most wanted, level by level, the coarsest first. Returns how many.
std::size_t TileSupply::make(const std::vector<TileKey>& wanted) {
  const std::size_t most = std::min(wanted.size(), most_at_a_time());
  std::vector<TileKey> tiles(wanted.begin(), wanted.begin() + std::ptrdiff_t(most));
  std::stable_sort(tiles.begin(), tiles.end(),
                   [](const TileKey& a, const TileKey& b) { return a.level > b.level; });
  std::size_t made = 0;
  for (auto from = tiles.begin(); from != tiles.end();) {
    const auto to = std::find_if(from, tiles.end(), [&](const TileKey& k) { return k.level != from->level; });
    for (const TileMaker::Made& m :
         maker_.make({from, to}, [&](const TileKey& k) { return cache_.take_slot(k); }))
      cache_.put(m.key, m.facts, m.slot), ++made;
    from = to;
  }
  return made;
}

// As many as the time allows, one at least; the root is awaited where nothing could be drawn without it.
// False if nothing could be made.
bool TileSupply::make_fetched() {
  if (!cache_.find(lattice_.root())) return make({lattice_.root()}) > 0;
  const auto most = std::size_t(std::max(1.0, options_.make_ms / ms_a_tile_));
  const std::vector<TileKey> fetched = fetcher_->take(wanted_, std::min(most, most_at_a_time()));
  if (fetched.empty()) return false;
  const Stopwatch watch;
  const std::size_t made = make(fetched);
  if (made == 0) return false;
  ms_a_tile_ += 0.2 * (watch.milliseconds() / double(made) - ms_a_tile_);
  return true;
}

const Selection& TileSupply::update(const Frustum& frustum, FrameStats& stats) {
  const TileMakerCounts before = maker_.counts();
  select(frustum, stats);
  if (fetcher_) {
    fetcher_->want(wanted_);
    if (make_fetched() || selection_.drawn.empty()) select(frustum, stats);
  } else {
    while (!wanted_.empty() && make(wanted_) > 0) select(frustum, stats);
  }
  note_made(before, maker_.counts(), stats);
  stats.tiles_wanted = selection_.wanted.size();
  // Blocks of better tiles are simplified until they too just keep to what was asked.
  if (!selection_.drawn.empty()) stats.pixels_reached = std::max(selection_.pixels, options_.pixel_error);
  for (const std::uint32_t k : selection_.drawn) {
    const Selection::Leaf& leaf = selection_.leaves[k];
    stats.tiles_coarse += leaf.pixels > options_.pixel_error && leaf.key.level > 0;
    stats.tiles_stale += cache_.find(leaf.key)->stale;
  }
  return selection_;
}

void TileSupply::release(bool moved, const std::vector<Extent>& changed, bool another_lattice) {
  if (moved) maker_.restart(), heights_ = heights_of(db_);
  if (another_lattice) cache_.clear();
  for (const Extent& e : changed) cache_.invalidate(lattice_, e);
  if (fetcher_) fetcher_->release(moved);
}

}  // namespace patchwork
