// The height at a point: patches of an extraction composed to one C^k surface with a bound.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "db/database.h"

namespace patchwork {

enum class Composition {
  priority,  ///< the most accurate patch speaks alone in its kernel; the bound keeps to the cut
  weighted   ///< all patches at a point, unit-volume Wendland weights (Patchwork Terrains, equation 1)
};

struct BlendOptions {
  int smoothness = 0;  ///< k = 0, 1, 2
  Composition composition = Composition::priority;
  bool strict = false;    ///< no data where the bound exceeds `error`
  double error = 0;       ///< metres, for `strict`
  bool fast_path = true;  ///< evaluate a batch inside one kernel directly; the bits do not depend on it
};

/// Where results go, one element a point; an empty span is not written.
struct BlendOutput {
  std::span<double> height;  ///< metres; NaN where there is no data
  std::span<double> bound;   ///< metres; NaN where there is no data
  std::span<std::int32_t>
      source;  ///< 1 + place in Database::grids(); negative where only a filled cell replies; 0 none
  std::span<std::int32_t>
      patch;  ///< place in the blend's patches of the one with the largest weight; -1 none
  std::span<float> height32 = {};  ///< the height rounded to float32, for rasters that hold no more
};

/// How many patches were read.
struct BlendCounts {
  std::uint64_t points = 0, contributions = 0, most = 0;
  double bound_max = 0;  ///< metres

  /// What two evaluations counted together.
  BlendCounts& operator+=(const BlendCounts& o) {
    points += o.points, contributions += o.contributions;
    most = std::max(most, o.most), bound_max = std::max(bound_max, o.bound_max);
    return *this;
  }
  /// Patches read a point; 0 without points.
  double mean() const { return points ? double(contributions) / double(points) : 0; }
};

/// Points of a raster: pixel (c, r) lies at (x0 + xc c + xr r, y0 + yc c + yr r).
struct RasterFrame {
  double x0 = 0, xc = 1, xr = 0, y0 = 0, yc = 0, yr = 1;
  Point at(double column, double row) const {
    return {x0 + (xc * column + xr * row), y0 + (yc * column + yr * row)};
  }
};

/// Whatever evaluates the surface: Blend on the CPU, VulkanBlend on a graphics card.
class Evaluator {
 public:
  virtual ~Evaluator() = default;
  /// Any number of points in any order. Points that are not finite have no data.
  virtual BlendCounts at_points(std::span<const double> x, std::span<const double> y,
                                const BlendOutput& out) const = 0;
  /// Pixels [0, width) x [row, row + rows), row-major.
  virtual BlendCounts at_pixels(const RasterFrame& raster, int width, int row, int rows,
                                const BlendOutput& out) const = 0;
};

/// REQUIRES: `db` outlives it. Evaluation is safe from many threads and uses all of them; its bits depend on
/// the data and the point alone. Throws Error for damaged payloads.
class Blend : public Evaluator {
 public:
  /// `patches` in the order of Extraction::patches.
  Blend(const Database& db, std::span<const PatchId> patches, const BlendOptions& options);

  BlendCounts at_points(std::span<const double> x, std::span<const double> y,
                        const BlendOutput& out) const override;
  BlendCounts at_pixels(const RasterFrame& raster, int width, int row, int rows,
                        const BlendOutput& out) const override;

  struct Placed;  ///< a patch with its map from the domain (blend.cpp, batch.cpp)

 private:
  const Database& db_;
  BlendOptions options_;
  std::shared_ptr<const std::vector<Placed>> placed_;
};

}  // namespace patchwork
