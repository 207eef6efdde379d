// What a database knows of one grid and of each of its patches, heights apart.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "db/frame.h"
#include "db/grid_shape.h"
#include "db/patch_id.h"

namespace patchwork {

using Digest = std::array<std::uint8_t, 16>;

/// The facts of a grid. A sample's height is `quantum * (code_origin + code) + base` metres.
struct GridInfo {
  GridId id;
  std::string name;
  Digest digest{};  ///< of frame, shape, accuracy, quantum and every sample: the grid's place in the order
  Frame frame;
  GridShape shape;
  double accuracy = 0;  ///< eps, metres
  double quantum = 1;   ///< metres per code
  double base = 0;      ///< metres
  std::int64_t code_origin = 0;
  double quantisation = 0;  ///< q, metres: largest distance between a sample and its stored form
  double rim_error = 0;     ///< metres added to the bound beyond the outer samples (extrapolated half cell)
  bool holes = false;
  int sample_bytes = 4;  ///< of the source file
  double height(double code) const { return quantum * (double(code_origin) + code) + base; }
};

/// A patch without its heights. Errors in metres, eps and q included.
struct PatchRecord {
  enum Flag : std::uint64_t { kExists = 1, kBest = 2, kRagged = 4 };
  std::array<double, 3> error{};  ///< of smoothness k = 0, 1, 2: the bound where this patch speaks
  /// The largest of `error`, one index for every k; at level 0 that of k = 0. A smooth surface through the
  /// samples departs from the bilinear one by as much as the data are rough, and if that counted a rough
  /// survey would rank behind the blurred one that it is meant to replace.
  double bottom = 0;
  double top = std::numeric_limits<double>::infinity();
  std::uint64_t flags = 0;

  bool exists() const { return flags & kExists; }
  /// Best available somewhere: its box reaches down to error 0.
  bool best() const { return flags & kBest; }
  /// Some cell of its domain holds no data.
  bool ragged() const { return flags & kRagged; }
  /// Redundant: kept, but in no cut.
  bool dormant() const { return top <= bottom; }
  bool operator==(const PatchRecord&) const = default;
};
static_assert(sizeof(PatchRecord) == 48);

/// What a ragged patch offers other grids as cover: at most eight disjoint rectangles of its block's cells.
struct Offer {
  std::uint32_t index = 0;  ///< GridShape::index of the patch
  std::uint32_t count = 0;
  std::array<std::array<std::uint8_t, 4>, 8>
      cells{};  ///< i0, j0, i1, j1 in level cells from the block's corner
  bool operator==(const Offer&) const = default;
};
static_assert(sizeof(Offer) == 40);

struct Grid {
  GridInfo info;
  std::vector<PatchRecord> patches;  ///< by GridShape::index; blocks without data do not exist()
  std::vector<Offer> offers;         ///< of ragged patches, sorted by index

  const PatchRecord& at(int level, int bx, int by) const { return patches[info.shape.index(level, bx, by)]; }
  PatchId patch_id(std::size_t index) const {
    const GridShape::Block b = info.shape.block(index);
    return PatchId::make(info.id, b.level, b.bx, b.by);
  }
};

}  // namespace patchwork
