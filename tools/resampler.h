// A raster of the surface: where its pixels lie, and its rows at any overview factor.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "blend/blend.h"
#include "db/buffer.h"
#include "query/extract.h"

namespace patchwork::cli {

/// A north-up raster over an extent of the domain.
struct Raster {
  double xmin = 0, ymax = 0, step = 1;  ///< metres; outer corner of the first pixel
  int width = 0, height = 0;

  /// The pixels of `step` that cover `extent`. Throws Error: a step that is not above 0, more than 2^31
  /// pixels a side.
  static Raster covering(const Extent& extent, double step);
  /// Of its pixels, which may reach beyond the extent that they cover.
  Extent extent() const { return {xmin, ymax - height * step, xmin + width * step, ymax}; }
  /// Pixel centres; those of an overview are every factor-th of this raster's, so that its heights keep their
  /// bounds.
  RasterFrame frame(int factor = 1) const;
};

/// The finest step of the grids that meet an extent, metres: what `--step` is where it is not given. `among`:
/// the grids that count; empty: all.
double finest_step(const Database& db, const Extent& extent, std::span<const GridId> among = {});

struct ResampleTally {
  BlendCounts full;          ///< of the full resolution
  double blend_seconds = 0;  ///< overviews included
};

/// Fills rows of the bands named (height, bound, source) as float32, NaN where there is no data. A bound
/// holds for the float32 height beside it.
class Resampler {
 public:
  /// Evaluates all at once, and tells its progress, if the raster fits into a quarter of `memory` (bytes),
  /// else rows as they are asked for.
  Resampler(const Evaluator& blend, const Raster& raster, std::vector<std::string> bands, std::size_t memory,
            const std::function<void(double)>& progress = {});
  void rows(int factor, int row, int rows, std::span<float* const> bands);
  bool whole() const { return !whole_.empty(); }  ///< all at once
  const ResampleTally& tally() const { return tally_; }

 private:
  void evaluate_whole(std::span<float* const> planes);
  void evaluate(int factor, int row, int rows, std::span<float* const> bands);
  const Evaluator& blend_;
  Raster raster_;
  std::vector<std::string> bands_;
  ResampleTally tally_;
  std::vector<Buffer<float>> whole_;  // the full resolution, a plane a band, where it fits
  bool done_ = false;
  std::function<void(double)> progress_;
  std::vector<double> bound_;
  std::vector<std::int32_t> source_;
};

/// Reads all patches of an extraction into the cache, in parallel, if they fit. Returns seconds; 0 where they
/// are read as the blend needs them.
double prefetch(const Database& db, std::span<const PatchId> patches, std::size_t memory);

}  // namespace patchwork::cli
