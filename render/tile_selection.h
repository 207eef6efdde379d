// Which tiles a frame draws: a restricted quadtree that keeps to the pixel error as far as tiles are there.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "render/tile_cache.h"

namespace patchwork {

struct SelectionOptions {
  double pixel_error = 1;         ///< pixels
  std::size_t most_tiles = 4096;  ///< that are drawn; the largest errors are refined first
  /// Of the cache, for all that is used or wanted: what matters less goes without.
  std::size_t slots = SIZE_MAX;
  HeightRange heights = {};  ///< metres: between which terrain may be now where a tile shows an old state
};

/// Tiles that cover what is seen without overlap; neighbours that share an edge differ by at most one level.
struct Selection {
  struct Leaf {
    TileKey key;
    double pixels = 0;   ///< the largest error of its mesh on the screen
    bool drawn = false;  ///< else out of sight, or without data
  };
  /// A tile that is missing, or stale, and how much it matters: pixels; below 0 for what is not drawn.
  struct Wanted {
    TileKey key;
    double pixels;
  };
  std::unordered_map<TileKey, std::uint32_t> tiles;  ///< places in `leaves`; kSplit for what is split
  std::vector<Leaf> leaves;                          ///< those that were split have drawn == false
  std::vector<std::uint32_t> drawn;                  ///< places in `leaves`, the largest error first
  std::vector<Wanted> wanted;                        ///< the most wanted first
  bool stale = false;  ///< where a leaf shows a state that has changed, there may be something else in sight
  double pixels = 0;   ///< error reached: the largest of all that is drawn and could be finer
  static constexpr std::uint32_t kSplit = UINT32_MAX;

  void clear();  ///< memory is kept

  /// The place of the leaf that holds tile `key` of any level on the side of (x, y) nearest to it, see .cpp.
  const Leaf* leaf_at(TileKey key, int towards_x, int towards_y) const;
};

/// Starts from the root, whose absence makes it the only one wanted. Begins a selection of the cache, and
/// marks what it uses there. `selection` is overwritten; its memory is kept.
void select_tiles(const TileLattice& lattice, const Frustum& frustum, const SelectionOptions& options,
                  TileCache& cache, Selection& selection);

}  // namespace patchwork
