// How high the surface can be: largest heights of the patches of an extraction, in a tree over the domain.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "blend/placed.h"
#include "db/lod_tree.h"

namespace patchwork {

/// Largest heights of blocks of 8 x 8 window cells of each patch: no blended height lies above those of the
/// patches at its place, because a blend is between its smallest and its largest contribution.
class HeightTree {
 public:
  static constexpr int kCells = 8;  ///< a block's, along each side
  static constexpr int kBlocks = (PatchSurface::kSide - 2 + kCells - 1) / kCells;

  /// Reads every patch once, on all threads. REQUIRES: `placed` and `db` outlive it. Throws Error: damaged
  /// payloads.
  HeightTree(const Database& db, const std::vector<Blend::Placed>& placed, int smoothness);

  /// Window rectangle of block (i, j): all that it speaks for, the part of the domain beside the window's
  /// first and last cells included.
  static LatticeRect block(int i, int j);
  /// Metres; no value of the patch over the block is larger. -infinity where it has no cell.
  float highest(std::size_t patch, int i, int j) const {
    return highest_[patch][std::size_t(j * kBlocks + i)];
  }

  /// Calls emit(place in `placed`) for patches whose bounds and largest height may_meet(bounds, height)
  /// accepts. REQUIRES: what accepts a box accepts a larger and higher one.
  template <class MayMeet, class Emit>
  void visit(MayMeet may_meet, Emit emit) const {
    tree_.traverse(
        [&](const LodBox& b) {
          return may_meet(Extent{b.xmin, b.ymin, b.xmax, b.ymax}, double(b.top) + lowest_);
        },
        [&](const LodEntry& e) { emit(std::size_t(e.id.value)); });
  }

 private:
  using Blocks = std::array<float, std::size_t(kBlocks* kBlocks)>;
  std::vector<Blocks> highest_;
  double lowest_ = 0;  // metres, of all: a LodBox's third axis begins at 0
  LodTree tree_;       // its third axis is the height
};

}  // namespace patchwork
