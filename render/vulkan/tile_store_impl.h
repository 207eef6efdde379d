// The slots of tiles on the card: heights, slopes, and the measures of their blocks.
#pragma once

#include <optional>

#include "render/tile_lattice.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

struct TileStore {
  static constexpr std::size_t kHeights = TileLattice::kVertices * TileLattice::kVertices;
  static constexpr std::size_t kBlocks = 64;       ///< of 8 x 8 cells
  static constexpr std::size_t kBlockBytes = 128;  ///< tile_finish.comp: kBlock texels
  /// What a slot takes: heights, slopes as pairs of half floats, the facts of blocks.
  static constexpr std::size_t kSlotBytes =
      4 * kHeights + 4 * TileLattice::kSamples * TileLattice::kSamples + kBlockBytes * kBlocks;

  /// Of a tile's mesh: 128 a block, and one more for each half cell that a finer neighbour adds to an edge.
  static constexpr std::uint32_t kMostTriangles = 64 * 128 + 4 * 64;

  static constexpr std::size_t kKnowledgeBytes = 4 * TileLattice::kSamples * TileLattice::kSamples;

  /// As many as `bytes` hold and the device's limits allow.
  static std::uint32_t slots_within(const Device::Impl& device, std::size_t bytes, bool knowing = false);
  /// `knowing`: slots hold bounds and sources too. Throws Error: out of memory.
  TileStore(const Device::Impl& device, std::uint32_t slots, bool knowing = false);

  std::uint32_t slots;
  Buffer heights, blocks;  ///< terrain.glsl, needs.comp
  OwnedView height_texels, block_texels;
  Texture slopes;                    ///< always in layout general: written by one shader, read by another
  std::optional<Texture> knowledge;  ///< of half cells: bound, source (as BlendOutput has it); as slopes are
  OwnedSampler sampler;
};

}  // namespace patchwork::vk
