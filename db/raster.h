// Height grids as GDAL gives them, checked and put into the database's units and CRS.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "db/frame.h"

namespace patchwork {

/// Accuracy taken where none is given: half a raw unit of integer samples, at least this part of the mean
/// step. An optimistic figure, so that the relief and not a guess decides what is shown; published RMS errors
/// are 5 % (lidar at 1 m) to 16 % (SRTM at 30 m) of the step. The warning that goes with it says so.
inline constexpr double kDefaultAccuracyPerStep = 0.02;

/// How a file is to be read; what is not given is taken from the file.
struct RasterOptions {
  std::optional<std::string> crs = {};   ///< overrides the file's CRS (any form that GDAL understands)
  std::optional<int> band = {};          ///< 1-based; required for a file of several bands
  std::vector<double> nodata = {};       ///< further raw values that mean "no data", beside the declared one
  std::optional<std::string> unit = {};  ///< m, ft, us-ft, cm; else the band's unit type, else metres
  double vertical_offset = 0;            ///< metres, added after the unit
  std::optional<double> accuracy = {};   ///< metres; else a stated default and a warning
};

/// Two descriptions (any form that GDAL understands) of one CRS, but for a vertical part.
bool same_crs(const std::string& a, const std::string& b);

/// One grid that can be read in rows, any number of times. Not safe for concurrent use.
class RasterSource {
 public:
  /// Opens `path`. `database_crs` (WKT2, or any form that GDAL understands) empty: the file decides (a file
  /// in degrees or feet is warped to the UTM or polar zone of its centre). A file whose CRS differs is warped
  /// to a grid in its own orientation: the largest height difference that this makes is measured, added to
  /// `accuracy` and said in `warnings`. Throws Error for whatever cannot be a height grid.
  static RasterSource open(const std::string& path, const RasterOptions& options,
                           const std::string& database_crs);
  /// The files as tiles of one grid (equal frames up to whole cells; equal type, units, nodata, registration
  /// and CRS); throws Error if they are not. Gaps have no data; where tiles overlap the earlier file speaks,
  /// and `warnings` says by how much they differ. path() is the first file.
  static RasterSource open_joined(const std::vector<std::string>& paths, const RasterOptions& options,
                                  const std::string& database_crs);
  RasterSource(RasterSource&&) noexcept;
  RasterSource& operator=(RasterSource&&) noexcept;
  ~RasterSource();

  const std::string& path() const;
  int width() const;               ///< samples along i, at least 2
  int height() const;              ///< samples along j, at least 2
  const Frame& frame() const;      ///< in the database's CRS
  bool pixel_is_area() const;      ///< the footprint reaches half a cell beyond the outer samples
  const std::string& crs() const;  ///< WKT2 of the database's CRS, empty where neither names one
  double accuracy() const;         ///< metres, cost of a warp included where it is largest
  /// The same for a rectangle of the grid's cells: a warp costs where the ground bends, and no more than it
  /// does there.
  double accuracy_in(const LatticeRect& cells) const;
  /// True: a height is exactly `scale() * n + offset()` for an integer sample n (no warp to other heights).
  bool integer_samples() const;
  double scale() const;   ///< metres per raw unit (band scale times unit)
  double offset() const;  ///< metres (band offset times unit, plus vertical offset)
  const std::vector<std::string>& warnings() const;
  /// Bytes of one raw sample in the file (1 to 8): what the database's size is compared with.
  int sample_bytes() const;
  /// GDAL's name of the raw samples' type ("Float64" after a warp), and the first value declared or given as
  /// no data.
  const std::string& sample_type() const;
  std::optional<double> nodata() const;
  /// True: every raw sample is a float exactly, so the cheaper read_rows into floats loses nothing.
  bool float_is_exact() const;

  /// Raw samples of rows [row, row + rows), row-major width() * rows; NaN where there is no data (declared or
  /// given nodata, NaN, infinities, masked pixels). Throws Error where the file ends early.
  /// REQUIRES: the rows are inside the grid and `out` holds width() * rows samples (float_is_exact() for
  /// floats).
  void read_rows(int row, int rows, std::span<double> out) const;
  void read_rows(int row, int rows, std::span<float> out) const;

 private:
  struct Impl;
  explicit RasterSource(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
