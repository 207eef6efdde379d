// The slots of tiles on the card: heights, slopes, and the measures of their blocks.
#pragma once

#include <optional>

#include "render/tile_lattice.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

struct TileStore {
  static constexpr std::size_t kHeights = TileLattice::kVertices * TileLattice::kVertices;
  static constexpr std::size_t kBlocks = 64;  ///< of 8 x 8 cells
  /// What a slot takes: heights, slopes as pairs of half floats, eight numbers a block.
  static constexpr std::size_t kSlotBytes =
      4 * kHeights + 4 * TileLattice::kSamples * TileLattice::kSamples + 32 * kBlocks;

  static constexpr std::size_t kKnowledgeBytes = 4 * TileLattice::kSamples * TileLattice::kSamples;

  /// As many as `bytes` hold and the device's limits allow.
  static std::uint32_t slots_within(const Device::Impl& device, std::size_t bytes, bool knowing = false);
  /// `knowing`: slots hold bounds and sources too. Throws Error: out of memory.
  TileStore(const Device::Impl& device, std::uint32_t slots, bool knowing = false);

  std::uint32_t slots;
  Buffer heights, blocks;  ///< terrain.glsl, factors.comp
  OwnedView height_texels, block_texels;
  Texture slopes;                    ///< always in layout general: written by one shader, read by another
  std::optional<Texture> knowledge;  ///< of half cells: bound, source (as BlendOutput has it); as slopes are
  OwnedSampler sampler;
};

}  // namespace patchwork::vk
