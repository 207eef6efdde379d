// A grid's own samples as a GeoTIFF of the type that they came in.
#pragma once

#include <functional>
#include <string>

#include "db/database.h"

namespace patchwork {

/// Writes `path` (tiled, DEFLATE; raw samples with scale, offset and nodata) and returns the name of its
/// type. A lossless import comes back bit by bit; otherwise the type is a float. The file appears whole under
/// its name or not at all. Throws Error.
std::string write_samples(const Database& db, const GridInfo& grid, const std::string& path,
                          const std::function<void(double)>& progress);

}  // namespace patchwork
