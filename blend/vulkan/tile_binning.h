// Which patches may reach which tile, and how each lies in it: all that shaders need, prepared in double.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "blend/placed.h"

namespace patchwork {

/// Vertices (c, r) of a tile, 0 <= c < across, 0 <= r < down, lie at (c0 + stride c, r0 + stride r) of a
/// lattice. A halo is part of it: c0 - stride, across + 2.
struct Tile {
  int c0 = 0, r0 = 0, stride = 1, across = 0, down = 0;
};

/// A patch in a tile. Window coordinate u of vertex (c, r) is the sum, over whole and rest, of
/// `x + y (c - anchor c) + z (r - anchor r)`: products of the whole parts (multiples of 2^-10) are exact in
/// float32 wherever the patch is, and the rests are below 2^-11, so u is good to some 2^-24 of a cell.
struct TileEntry {
  float whole_u[3], anchor_c;
  float rest_u[3], anchor_r;
  float whole_v[3], slot;
  float rest_v[3], height;  ///< metres: of the patch's origin code, against the base
  float quantum, origin;    ///< metres a code; the code
  float error;              ///< metres, for the blend's smoothness
  float grid;               ///< id + 1: 0 means that nothing answers, and the sign that a cell was filled
};
static_assert(sizeof(TileEntry) == 80);

/// common.glsl: Tile.
struct TileHeader {
  std::uint32_t first, count;  ///< of the entries, in order of the patches
  std::uint32_t lists;         ///< words before those of its blocks
  Tile tile;
};
static_assert(sizeof(TileHeader) == 32);

struct TileBins {
  std::vector<TileHeader> tiles;
  std::vector<TileEntry> entries;
  std::uint64_t lists = 0;  ///< words for the lists of all blocks
};

/// What a slot has of a patch (PatchPool::Resident).
struct SlotOf {
  std::uint32_t slot;
  float origin;
  double height;  ///< metres
};

/// For each tile the patches that may reach it, in order. With `priority` those after one whose kernel holds
/// the tile are left out.
std::vector<Candidates> choose_patches(const std::vector<Blend::Placed>& placed, const RasterFrame& lattice,
                                       std::span<const Tile> tiles, bool priority);

/// `blocks`: of a tile; `base`: metres.
TileBins bin_tiles(const std::vector<Blend::Placed>& placed, std::span<const SlotOf> slots,
                   const RasterFrame& lattice, std::span<const Tile> tiles,
                   std::span<const Candidates> chosen, std::uint32_t blocks, double base);

/// How `p` lies in `tile`; anchored at the vertex nearest to the middle of its window.
TileEntry make_entry(const Blend::Placed& p, SlotOf slot, const RasterFrame& lattice, const Tile& tile,
                     double base);

}  // namespace patchwork
