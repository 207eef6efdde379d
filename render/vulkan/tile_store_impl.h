// The slots of tiles on the card: heights, slopes, and the measures of their blocks.
#pragma once

#include <optional>

#include "render/tile_lattice.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

struct TileStore {
  static constexpr std::size_t kHeights = TileLattice::kVertices * TileLattice::kVertices;
  static constexpr std::size_t kBlocks = 64;  ///< of 8 x 8 cells
  /// What slots are for, besides heights and slopes.
  struct Holds {
    bool knowledge = false;  ///< bounds and sources
    bool meshes = false;  ///< facts of blocks as mesh_finish.comp makes them, else as tile_finish.comp does
  };

  /// As many as `bytes` hold, what is made of them to be drawn included, and the device's limits allow.
  static std::uint32_t slots_within(const Device::Impl& device, std::size_t bytes, const Holds& holds);
  /// Throws Error: out of memory.
  TileStore(const Device::Impl& device, std::uint32_t slots, const Holds& holds);

  Holds holds;
  std::uint32_t slots;
  Buffer heights, blocks;  ///< terrain.glsl; factors.comp or needs.comp
  OwnedView height_texels, block_texels;
  Texture slopes;                    ///< always in layout general: written by one shader, read by another
  std::optional<Texture> knowledge;  ///< of half cells: bound, source (grid id + 1); as slopes are
  OwnedSampler sampler;
};

}  // namespace patchwork::vk
