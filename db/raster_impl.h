// Private to the raster reader: what its parts (opening, joining, warping) hand to each other. Includes GDAL.
#pragma once

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "db/cost_field.h"
#include "db/error.h"
#include "db/raster.h"

namespace patchwork::raster_impl {

/// While one lives, GDAL's messages on this thread are kept here instead of being printed. The first one made
/// in the process registers GDAL's drivers. Not movable: GDAL holds its address.
class GdalMessages {
 public:
  GdalMessages();
  ~GdalMessages();
  GdalMessages(const GdalMessages&) = delete;
  GdalMessages& operator=(const GdalMessages&) = delete;
  /// GDAL reported a failure, whatever the call returned: some drivers return success all the same.
  bool failed() const { return failed_; }
  /// `problem`, with GDAL's last message behind it where there is one.
  std::string explain(const std::string& problem) const;

 private:
  static void keep(CPLErr level, CPLErrorNum number, const char* text);
  bool failed_ = false;
  std::string last_;
};

/// Raw samples by rows, NaN where there is no data; reading throws Error where the data ends early.
class Rows {
 public:
  virtual ~Rows() = default;
  virtual void read(int row, int rows, double* out) = 0;
  virtual void read(int row, int rows, float* out) = 0;
};

/// One grid as its file has it: raw values, the file's CRS.
struct RawGrid {
  std::string path;
  int width = 0, height = 0;
  std::array<double, 6> geotransform{};  ///< of pixel corners, as GDAL has it
  bool pixel_is_area = true;
  std::optional<OGRSpatialReference> crs;  ///< horizontal part, x before y
  GDALDataType type = GDT_Unknown;
  std::vector<double> nodata;    ///< declared and given, those that a sample can equal; sorted
  double scale = 1, offset = 0;  ///< height in metres = scale * raw + offset
  std::vector<std::string> warnings;
  std::unique_ptr<Rows> rows;

  Frame frame() const { return Frame::from_geotransform(geotransform, path); }
};

/// GDAL 3.6 knows signed bytes only as bytes with a mark; their samples are put right when read.
bool is_signed_byte(GDALRasterBand& band);
std::unique_ptr<Rows> make_file_rows(const std::string& path, GDALDatasetUniquePtr dataset, int band,
                                     const std::vector<double>& nodata);

/// Throws Error for options that no file could meet.
void check_options(const RasterOptions& options);
/// Opens one file and checks everything but its CRS against the database's.
RawGrid open_raw(const std::string& path, const RasterOptions& options);
/// REQUIRES: at least one path.
RawGrid join_raw(const std::vector<std::string>& paths, const RasterOptions& options);

/// Parses any form that GDAL understands, without network; throws Error naming `where`.
OGRSpatialReference parse_crs(const std::string& text, const std::string& where);
/// Drops a vertical part (true: there was one) and fixes the order of axes to x, y.
bool make_horizontal(OGRSpatialReference& crs);
bool same_crs(const OGRSpatialReference& a, const OGRSpatialReference& b);
std::string to_wkt2(const OGRSpatialReference& crs);
/// "EPSG:26710" where the CRS has a code, else its name.
std::string crs_label(const OGRSpatialReference& crs);
/// The CRS that `grid` must be in: the database's, else its own, else the zone of its centre (with a
/// warning). Empty where neither names one.
std::optional<OGRSpatialReference> domain_crs(RawGrid& grid, const std::string& database_crs);

/// A grid in another CRS, held in memory (above 256 MB in an unlinked temporary file).
struct WarpedGrid {
  int width = 0, height = 0;
  std::array<double, 6> geotransform{};
  std::unique_ptr<Rows> rows;
  CostField cost;  ///< raw units: the largest differences found between the two surfaces
};

/// Bilinear samples of `source` on a grid of `target` in the source's orientation, with the source's steps.
/// Throws Error where the source cannot be transformed or there is no room for it.
WarpedGrid warp(const RawGrid& source, const OGRSpatialReference& target);

}  // namespace patchwork::raster_impl
