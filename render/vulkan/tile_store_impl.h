// The slots of tiles on the card: heights, slopes, and the measures of their blocks.
#pragma once

#include "render/tile_lattice.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

struct TileStore {
  static constexpr std::size_t kHeights = TileLattice::kVertices * TileLattice::kVertices;
  static constexpr std::size_t kBlocks = 64;  ///< of 8 x 8 cells
  /// What a slot takes: heights, slopes as pairs of half floats, eight numbers a block.
  static constexpr std::size_t kSlotBytes =
      4 * kHeights + 4 * TileLattice::kSamples * TileLattice::kSamples + 32 * kBlocks;

  /// As many as `bytes` hold and the device's limits allow.
  static std::uint32_t slots_within(const Device::Impl& device, std::size_t bytes);
  /// Throws Error: out of memory.
  TileStore(const Device::Impl& device, std::uint32_t slots);

  std::uint32_t slots;
  Buffer heights, blocks;  ///< terrain.glsl, factors.comp
  OwnedView height_texels, block_texels;
  Texture slopes;  ///< always in layout general: written by one shader, read by another
  OwnedSampler sampler;
};

}  // namespace patchwork::vk
