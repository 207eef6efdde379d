// What the patches that a tile is made of say of it and of its blocks, before it is made.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "blend/placed.h"
#include "render/tile_lattice.h"

namespace patchwork {

struct TilePatches {
  static constexpr int kBlocks = 8;  ///< of 8 x 8 cells, along each side
  /// What patches lack where they reach a block, metres. As tile_finish.glsl reads it.
  struct Block {
    /// What may stick out between the samples of a half cell, because cells are smaller than that; below 0
    /// where no patch reaches the block, but for its border.
    float unsampled = -1;
    /// The share of a bound that no finer patch takes away: what the grid's samples may be off there, where
    /// there is only one, since its patches lie within the rest of its bilinear surface; all of it where the
    /// tile has the best patches there are.
    float lasting = 0;

    bool reached() const { return unsampled >= 0; }
  };
  std::array<Block, kBlocks * kBlocks> blocks;  ///< row-major, from the smallest x and y
  std::size_t patches = 0;                      ///< that reach the tile or its halo
  HeightRange heights;                          ///< of the surfaces of their grids
  bool reached() const { return std::any_of(blocks.begin(), blocks.end(), std::mem_fn(&Block::reached)); }

  /// `placed`: patches of the tile's level, `ids` (ascending) the same ones. Reads records of patches.
  static TilePatches of(const Database& db, std::span<const Blend::Placed> placed,
                        const std::vector<PatchId>& ids, const TileLattice& lattice, const TileKey& tile);
  /// Reads what `of` reads.
  static void prefetch(const Database& db, const std::vector<PatchId>& ids, const TileLattice& lattice,
                       const TileKey& tile);
};

/// The tile and the halo of one vertex that its making reads.
Extent with_halo(const TileLattice& lattice, const TileKey& tile);

}  // namespace patchwork
