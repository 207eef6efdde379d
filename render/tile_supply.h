// The tiles of each frame: selected, and made where they are missing.
#pragma once

#include <memory>

#include "render/renderer.h"
#include "render/tile_fetcher.h"
#include "render/tile_selection.h"
#include "render/vulkan/tile_maker.h"

namespace patchwork {

class TileSupply {
 public:
  /// REQUIRES: `db`, `lattice` and `store` outlive it. `base`: metres, of the heights in the slots.
  TileSupply(std::shared_ptr<Device> device, const Database& db, const TileLattice& lattice,
             vk::TileStore& store, double base, const RendererOptions& options);

  /// What to draw. Without RendererOptions::realtime all that it needs has been made; else what was fetched
  /// and fits into make_ms, while missing tiles are drawn by their ancestors.
  const Selection& update(const Frustum& frustum, FrameStats& stats);
  void set_pixel_error(double pixels) { options_.pixel_error = pixels; }
  const TileCache& cache() const { return cache_; }
  const Selection& selection() const { return selection_; }  ///< of the last update
  const HeightRange& heights() const { return heights_; }    ///< metres: of all surfaces
  std::uint32_t most_tiles() const { return most_tiles_; }

  /// True if no worker reads any more: the database may move on until release(). Else ask again a frame
  /// later.
  bool hold() { return !fetcher_ || fetcher_->hold(); }
  /// `moved`: it did; then tiles that `changed` touches are made anew, or all where the lattice is another
  /// one.
  void release(bool moved, const std::vector<Extent>& changed, bool another_lattice);

 private:
  void select(const Frustum& frustum, FrameStats& stats);
  std::size_t make(const std::vector<TileKey>& wanted);
  std::size_t most_at_a_time() const;
  bool make_fetched();

  const Database& db_;
  const TileLattice& lattice_;
  RendererOptions options_;
  HeightRange heights_;
  TileCache cache_;
  TileMaker maker_;
  std::unique_ptr<TileFetcher> fetcher_;  // only in the background
  Selection selection_;
  std::vector<TileKey> wanted_;
  std::uint32_t most_tiles_;
  double ms_a_tile_ = 4;  // a running mean
};

}  // namespace patchwork
