// How a grid that is to come lies against what the database holds: a robust offset and tilt.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "db/database.h"

namespace patchwork::cli {

/// new minus existing = offset + tilt_x (x - centre) + tilt_y (y - centre), fitted so that outliers do not
/// pull.
struct Comparison {
  double offset = 0;              ///< metres, at the centre of the points
  double tilt_x = 0, tilt_y = 0;  ///< metres per metre
  double spread = 0;              ///< metres: 1.4826 times the median distance from the fit
  std::size_t points = 0;         ///< where both have heights
};

/// Nothing where the two do not overlap (fewer than three points). Reported, never applied.
std::optional<Comparison> compare(const Database& db, const RasterSource& source);

}  // namespace patchwork::cli
