// The stored form of a chunk: samples of 112 x 112 vertices of one level and, where there are holes, masks of
// its cells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "db/grid_shape.h"

namespace patchwork {

/// Vertices [112 cx, 112 cx + cols) x [112 cy, 112 cy + rows) of a level, row-major, and the cells that start
/// at them.
struct Chunk {
  int cols = 0, rows = 0;
  std::vector<std::int32_t> codes;
  std::vector<std::uint8_t> cells;  ///< CellMasks::Cell bits; empty where every cell is real
};

/// A chunk's size in vertices; smaller at the far ends of a level.
Chunk make_chunk(const GridShape& shape, int level, int cx, int cy);

/// Format: byte 'C', byte version 2, byte 1 if cells follow, byte 0, uint32 little-endian length of the
/// codes' blob (codec.h), that blob, then the cells as a second blob of the same codec, always without a
/// parent. `parent` is chunk (cx / 2, cy / 2) of the level above, or null at the coarsest level.
std::vector<std::byte> encode_chunk(const Chunk& chunk, const Chunk* parent = nullptr, int cx = 0,
                                    int cy = 0);

/// Fills `chunk`, whose cols and rows say what is expected, given the parent that encoded it; returns "" or
/// what is wrong with the bytes.
std::string decode_chunk(std::span<const std::byte> bytes, Chunk& chunk, const Chunk* parent = nullptr,
                         int cx = 0, int cy = 0);

}  // namespace patchwork
