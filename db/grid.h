// What a database knows of one grid and of each of its patches, heights apart.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "db/frame.h"
#include "db/grid_shape.h"
#include "db/patch_id.h"
#include "db/patch_records.h"

namespace patchwork {

using Digest = std::array<std::uint8_t, 16>;

/// Metres; lowest > highest where there is none.
struct HeightRange {
  double lowest = std::numeric_limits<double>::infinity(), highest = -std::numeric_limits<double>::infinity();
  void add(const HeightRange& o) {
    lowest = std::min(lowest, o.lowest), highest = std::max(highest, o.highest);
  }
  /// To a metre; 0 where there is none.
  double middle() const { return lowest <= highest ? std::nearbyint(0.5 * (lowest + highest)) : 0; }
};

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
  double lowest = 0, highest = 0;  ///< of its samples, metres
  /// Metres that its level-0 surface may stand above or below all samples: half cells beyond the outer ones,
  /// and what smooth interpolants (k = 1, 2) make of rough samples.
  double overshoot = 0;
  bool holes = false;
  /// How the source file held its samples, so that they can be written back as they were: a raw sample is
  /// `quantum / raw_scale * (code_origin + code)`, of a GDAL type, e.g. "UInt16".
  std::string sample_type = "Float32";
  int sample_bytes = 4;               ///< of one raw sample
  double raw_scale = 1;               ///< metres per raw unit
  std::optional<double> nodata = {};  ///< the raw value that meant no data, where one was declared
  double height(double code) const { return quantum * (double(code_origin) + code) + base; }
  /// Of its level-0 surface, whatever the smoothness.
  HeightRange surface_heights() const { return {lowest - overshoot, highest + overshoot}; }
  /// Of the footprint, rounding allowed for.
  Extent bounds() const { return frame.bounds(shape.footprint()); }
};

struct Grid {
  GridInfo info;
  PatchRecords patches;  ///< by GridShape::index

  const PatchRecord& at(int level, int bx, int by) const { return patches[info.shape.index(level, bx, by)]; }
  PatchId patch_id(std::size_t index) const {
    const GridShape::Block b = info.shape.block(index);
    return PatchId::make(info.id, b.level, b.bx, b.by);
  }
};

/// Blocks [i0, i1] x [j0, j1] of a level.
struct BlockRange {
  int i0, j0, i1, j1;
};

/// The blocks of a level whose kernels can meet `extent` (metres, domain); never too few.
BlockRange blocks_near(const GridInfo& grid, int level, const Extent& extent);

}  // namespace patchwork
