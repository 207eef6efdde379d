// What one would use instead: one uniform GeoTIFF with GDAL's overviews.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/cost/check_points.h"

namespace patchwork::cli {

/// The best available surface at the finest step of the grids (at most kMostSide samples along a side and a
/// quarter of the memory), float32, tiles with ZSTD, bilinear overviews down to a few samples.
class UniformGrid {
 public:
  static constexpr int kMostSide = 8192;
  UniformGrid(const Database& db, const Extent& extent, const CheckPoints& points, const std::string& path,
              std::uint64_t memory);
  ~UniformGrid();

  int levels() const;
  int factor(int level) const;
  std::size_t bytes(int level) const;  ///< of its samples in memory
  std::size_t file_bytes() const;
  double step() const { return step_; }        ///< metres, of level 0
  bool complete() const { return complete_; }  ///< level 0 has the finest step of all grids
  ErrorFigures error(int level, std::span<const double> scale) const;
  /// Milliseconds for side x side heights over `window` (metres) from this level of the file: bilinear, but
  /// the nearest samples where it has more of them; decoded on all cores. The file is open, as a database is,
  /// and none of its blocks in memory.
  double read(int level, const Extent& window, int side) const;

 private:
  struct Level;
  Extent extent_;
  const CheckPoints& points_;
  std::string path_;
  double step_ = 0;
  bool complete_ = true;
  std::vector<Level> levels_;
};

}  // namespace patchwork::cli
