// A raster of heights against the terrain function that its sources were sampled from.
#pragma once

#include <cstdint>
#include <string>

#include "tools/cli.h"
#include "tools/terrain_function.h"

namespace patchwork::cli {

struct TruthFigures {
  std::uint64_t pixels = 0;            ///< compared
  double rms = 0, p99 = 0, max = 0;    ///< metres
  std::uint64_t beyond_the_bound = 0;  ///< where the file has a second band, the bound: pixels farther off
  Json json() const;
};

/// Every `stride`-th pixel each way, but for a rim of 16 pixels. Pixels without data are not compared. Throws
/// Error where the file cannot be read.
TruthFigures compare_with_truth(const std::string& path, const HeightField& truth, int stride);

}  // namespace patchwork::cli
