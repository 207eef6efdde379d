// A Cloud Optimized GeoTIFF written strip by strip from rows that are made on demand.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace patchwork {

/// Key and value of one metadata item.
using MetadataItems = std::vector<std::pair<std::string, std::string>>;

/// One float32 band; nodata is NaN.
struct SurfaceBand {
  std::string name;        ///< the band's description: height, bound, source
  std::string unit = "m";  ///< empty where the band has none (source)
  MetadataItems metadata{};
};

/// What the file will say of itself.
struct SurfaceRaster {
  int width = 0, height = 0;                             ///< pixels, at least 1
  std::array<double, 6> geotransform{0, 1, 0, 0, 0, 1};  ///< GDAL's, of the pixels' corners
  std::string crs_wkt{};                                 ///< any form that GDAL understands; empty: none
  std::vector<SurfaceBand> bands{};
  std::string compression = "NONE";  ///< all lossless: NONE, DEFLATE, ZSTD, or LERC (one band)
  MetadataItems metadata{};
};

/// Fills rows [row, row + rows) of every band, each row-major and as wide as the raster at that overview
/// factor (1, 2, 4, ...: ceil(width / f) x ceil(height / f) pixels). Pixel (i, j) of factor f stands for the
/// pixels [f i, f i + f) x [f j, f j + f). Called from one thread, for each row of each factor once, the
/// coarsest factor first and each from the top. What it throws passes through `write_cog`.
using RowSource = std::function<void(int overview_factor, int row, int rows, std::span<float* const> bands)>;

/// Told the part done, 0 to 1, never falling. What it throws ends the writing and passes through.
using ProgressCallback = std::function<void(double)>;

/// The overview factors such a raster gets, 2, 4, ...: until both sides are at most 512 pixels.
std::vector<int> overview_factors(int width, int height);

/// Writes `path` as a COG with tiles of 512 x 512 pixels, interleaved by pixel. The file appears whole under
/// its name or not at all; one that was there is replaced. Holds one strip of 512 rows of all bands and
/// about 20 MB of GDAL's in memory. Throws Error(path, ...).
void write_cog(const std::string& path, const SurfaceRaster& raster, const RowSource& source,
               const ProgressCallback& progress = {});

}  // namespace patchwork
