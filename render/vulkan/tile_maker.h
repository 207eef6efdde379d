// Makes tiles: the extraction of their level, the blend on the card, their slots.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "blend/vulkan/vulkan_blend.h"
#include "render/tile_cache.h"

namespace patchwork {

namespace vk {
struct TileStore;
}

struct TileMakerCounts {
  std::uint64_t tiles = 0, patches = 0, bytes = 0;  ///< made; sent to the card
  std::uint64_t dispatches = 0;                     ///< of tile_finish.glsl
  BlendCounts blended;                              ///< of all samples of the tiles made
  BlockShares blocks;                               ///< the same by blocks of 8 x 8
  double extract_ms = 0, send_ms = 0, blend_ms = 0, finish_ms = 0;
};

class TileMaker {
 public:
  struct Made {
    TileKey key;
    TileFacts facts;
    std::uint32_t slot;  ///< TileCache::kNoSlot: nothing answers there
  };
  using TakeSlot = std::function<std::uint32_t(const TileKey&)>;

  /// `base`: metres, what the heights in the slots are relative to. `memory`: bytes for patches on the card.
  /// `published`: blocks are measured as published too.
  TileMaker(std::shared_ptr<Device> device, const Database& db, const TileLattice& lattice,
            vk::TileStore& store, double base, const BlendOptions& blend, std::size_t memory, bool published);
  ~TileMaker();

  /// Makes tiles of one level; take_slot is asked for each that has data, and ends the work where it has
  /// none.
  std::vector<Made> make(std::span<const TileKey> tiles, const TakeSlot& take_slot);
  /// Reads what `make` would read, so that it need not wait for a disk. Safe beside it.
  static void prefetch(const Database& db, const TileLattice& lattice, const TileKey& tile);
  /// After the database moved to another state.
  void restart();
  const TileMakerCounts& counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
