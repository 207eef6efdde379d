// The blocks of one grid at every level: kernels, domains and lattice sizes, all in exact lattice
// coordinates.
#pragma once

#include <cstddef>
#include <vector>

#include "db/frame.h"

namespace patchwork {

inline constexpr int kKernelCells = 28;    ///< K: cells of a block, at its own level
inline constexpr int kExtensionCells = 2;  ///< m: cells by which the domain outgrows the block
/// Level-0 cells over which a grid fades at the border of its data. Two cells leave a step where
/// surveys disagree: at the edge of a 3 arc second grid on a 30 arc second one the mean step was 1.9 times
/// its neighbourhood's, with eight 1.1 times.
inline constexpr int kFeatherCells = 8;
inline constexpr int kHoleFeatherCells = 2;              ///< the same towards holes inside
inline constexpr int kChunkVertices = 4 * kKernelCells;  ///< side of a stored payload chunk, vertices

/// Pure arithmetic on width, height and registration (design: model, section 2). Rectangles are in level-0
/// cells.
class GridShape {
 public:
  static constexpr int kMostSamples = kKernelCells
                                      << 21;              ///< along an axis: PatchId counts blocks in 21 bits
  static constexpr std::size_t kMostBlocks = 0x7fffffff;  ///< of all levels: index() counts in 31 bits

  GridShape() = default;
  /// REQUIRES: width, height >= 2.
  GridShape(int width, int height, bool pixel_is_area);

  int width() const { return width_; }
  int height() const { return height_; }
  bool pixel_is_area() const { return pad_ > 0; }
  double pad() const { return pad_; }  ///< cells by which the footprint outgrows the outer samples
  int levels() const { return int(levels_.size()); }

  LatticeRect footprint() const { return {-pad_, -pad_, width_ - 1 + pad_, height_ - 1 + pad_}; }
  /// Where the outer samples lie.
  LatticeRect samples() const { return {0, 0, width_ - 1.0, height_ - 1.0}; }
  /// The footprint shrunk by one feather: what the kernels of every level cover together.
  LatticeRect core() const { return core_; }

  int blocks_i(int level) const { return levels_[size_t(level)].bi; }
  int blocks_j(int level) const { return levels_[size_t(level)].bj; }
  /// Stored vertices along each axis: every 2^level-th, the last one at or beyond the grid's last sample.
  int lattice_cols(int level) const { return ((width_ - 2) >> level) + 2; }
  int lattice_rows(int level) const { return ((height_ - 2) >> level) + 2; }
  int chunks_i(int level) const { return (lattice_cols(level) + kChunkVertices - 1) / kChunkVertices; }
  int chunks_j(int level) const { return (lattice_rows(level) + kChunkVertices - 1) / kChunkVertices; }

  LatticeRect kernel(int level, int bx, int by) const;
  LatticeRect domain(int level, int bx, int by) const;

  bool has(int level, int bx, int by) const {
    return level < levels() && bx < blocks_i(level) && by < blocks_j(level);
  }
  /// Number of blocks of all levels, and the place of one in a flat array of them: by level, then by tiles of
  /// 16 x 16 blocks (rows of tiles, tiles, rows of blocks, blocks), so that neighbours lie together.
  std::size_t blocks() const { return blocks_; }
  std::size_t index(int level, int bx, int by) const;
  struct Block {
    int level, bx, by;
  };
  Block block(std::size_t index) const;

 private:
  struct Level {
    int bi, bj;
    std::size_t first;
  };
  int width_ = 2, height_ = 2;
  double pad_ = 0;
  LatticeRect core_;
  static constexpr int kTile = 16;
  std::vector<Level> levels_;
  std::size_t blocks_ = 0;
};

}  // namespace patchwork
