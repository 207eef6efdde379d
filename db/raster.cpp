#include "db/raster.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <utility>

#include "db/grid_shape.h"
#include "db/raster_impl.h"

namespace patchwork {

using raster_impl::RawGrid;

namespace {

// What a RasterSource answers; gathered from the file's grid, then changed by a warp.
struct Facts {
  std::string path, crs;
  int width = 0, height = 0;
  Frame frame;
  bool pixel_is_area = true, integer_samples = false, float_is_exact = false;
  double accuracy = 0, scale = 1, offset = 0;  // accuracy: as claimed
  CostField cost;                              // of a warp, raw units
  int sample_bytes = 1;
  std::string sample_type;
  std::optional<double> nodata;
  std::vector<std::string> warnings;
  std::unique_ptr<raster_impl::Rows> rows;
};

std::string metres(double v) {
  char text[40];
  std::snprintf(text, sizeof text, v < 0.01 ? "%.2g m" : "%.2f m", v);
  return text;
}

// Rounded up, so that the figure a person reads is never below the one that is added.
std::string metres_up(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.2f m", std::ceil(v * 100) / 100);
  return text;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

// Every value of these types is a float: integers of up to 16 bits, and floats.
bool fits_float(GDALDataType type) {
  return type == GDT_Float32 || (GDALDataTypeIsInteger(type) && GDALGetDataTypeSizeBytes(type) <= 2);
}

Facts describe(const RawGrid& raw) {
  Facts f;
  f.path = raw.path;
  f.width = raw.width;
  f.height = raw.height;
  f.pixel_is_area = raw.pixel_is_area;
  f.integer_samples = GDALDataTypeIsInteger(raw.type);
  f.float_is_exact = fits_float(raw.type);
  f.scale = raw.scale;
  f.offset = raw.offset;
  f.sample_bytes = GDALGetDataTypeSizeBytes(raw.type);
  f.sample_type = GDALGetDataTypeName(raw.type);
  if (!raw.nodata.empty()) f.nodata = raw.nodata.front();
  f.warnings = raw.warnings;
  return f;
}

// Replaces the grid by its warped form, and notes what that may cost.
void warp_into(Facts& f, RawGrid& raw, const OGRSpatialReference& target) {
  auto warped = raster_impl::warp(raw, target);
  f.cost = std::move(warped.cost);
  const double cost = f.cost.largest() * std::abs(raw.scale);
  f.warnings.push_back("warped from " + raster_impl::crs_label(*raw.crs) + " to " +
                       raster_impl::crs_label(target) + ", " + size_text(raw.width, raw.height) + " to " +
                       size_text(warped.width, warped.height) + " samples; up to " + metres_up(cost) +
                       " added to its accuracy, by place");
  f.integer_samples = f.float_is_exact = false;
  f.sample_type = GDALGetDataTypeName(GDT_Float64), f.nodata.reset();
  f.width = warped.width;
  f.height = warped.height;
  raw.geotransform = warped.geotransform;
  raw.rows = std::move(warped.rows);
}

// `quantum`: metres between the file's neighbouring values, 0 for floats; a warp does not undo it.
double assumed_accuracy(Facts& f, double quantum) {
  const double step = (f.frame.step_i() + f.frame.step_j()) / 2;
  const double assumed = std::max(quantum / 2, kDefaultAccuracyPerStep * step);
  f.warnings.push_back("no accuracy given: taken as " + metres(assumed) +
                       " (half a raw unit of integers, at least 2 % of the step); better give --accuracy");
  return assumed;
}

// From the file's grid to the database's: CRS, warp, accuracy.
Facts finish(RawGrid raw, const RasterOptions& options, const std::string& database_crs) {
  if (raw.width < 2 || raw.height < 2)
    throw Error(raw.path, "is a grid of " + size_text(raw.width, raw.height) + " samples",
                "a surface needs at least 2 x 2");
  if (std::max(raw.width, raw.height) > GridShape::kMostSamples)
    throw Error(raw.path, "is a grid of " + size_text(raw.width, raw.height) + " samples",
                "a side has " + std::to_string(GridShape::kMostSamples) + " at most");
  if (GridShape(raw.width, raw.height, true).blocks() > GridShape::kMostBlocks)
    throw Error(raw.path, "is a grid of " + size_text(raw.width, raw.height) + " samples",
                "cut it into parts, e.g. with gdal_translate -srcwin");
  raw.frame();  // a sheared or degenerate file is refused before its heights are read
  const auto target = raster_impl::domain_crs(raw, database_crs);
  Facts f = describe(raw);
  if (target) f.crs = raster_impl::to_wkt2(*target);
  const double quantum = f.integer_samples ? std::abs(f.scale) : 0;
  if (target && raw.crs && !raster_impl::same_crs(*raw.crs, *target)) warp_into(f, raw, *target);
  f.frame = raw.frame();
  f.accuracy = options.accuracy ? *options.accuracy : assumed_accuracy(f, quantum);
  f.rows = std::move(raw.rows);
  return f;
}

}  // namespace

struct RasterSource::Impl : Facts {};

RasterSource RasterSource::open(const std::string& path, const RasterOptions& options,
                                const std::string& database_crs) {
  const raster_impl::GdalMessages quiet;
  raster_impl::check_options(options);
  return RasterSource(
      std::unique_ptr<Impl>(new Impl{finish(raster_impl::open_raw(path, options), options, database_crs)}));
}

RasterSource RasterSource::open_joined(const std::vector<std::string>& paths, const RasterOptions& options,
                                       const std::string& database_crs) {
  const raster_impl::GdalMessages quiet;
  if (paths.empty()) throw Error("join", "no files given", "name at least one");
  raster_impl::check_options(options);
  return RasterSource(
      std::unique_ptr<Impl>(new Impl{finish(raster_impl::join_raw(paths, options), options, database_crs)}));
}

RasterSource::RasterSource(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RasterSource::RasterSource(RasterSource&&) noexcept = default;
RasterSource& RasterSource::operator=(RasterSource&&) noexcept = default;
RasterSource::~RasterSource() = default;

const std::string& RasterSource::path() const { return impl_->path; }
int RasterSource::width() const { return impl_->width; }
int RasterSource::height() const { return impl_->height; }
const Frame& RasterSource::frame() const { return impl_->frame; }
bool RasterSource::pixel_is_area() const { return impl_->pixel_is_area; }
const std::string& RasterSource::crs() const { return impl_->crs; }
double RasterSource::accuracy() const {
  return impl_->accuracy + impl_->cost.largest() * std::abs(impl_->scale);
}
double RasterSource::accuracy_in(const LatticeRect& cells) const {
  return impl_->accuracy + impl_->cost.most(cells) * std::abs(impl_->scale);
}
bool RasterSource::integer_samples() const { return impl_->integer_samples; }
double RasterSource::scale() const { return impl_->scale; }
double RasterSource::offset() const { return impl_->offset; }
const std::vector<std::string>& RasterSource::warnings() const { return impl_->warnings; }
int RasterSource::sample_bytes() const { return impl_->sample_bytes; }
const std::string& RasterSource::sample_type() const { return impl_->sample_type; }
std::optional<double> RasterSource::nodata() const { return impl_->nodata; }
bool RasterSource::float_is_exact() const { return impl_->float_is_exact; }

void RasterSource::read_rows(int row, int rows, std::span<double> out) const {
  assert(row >= 0 && rows >= 0 && row <= height() - rows);
  assert(out.size() >= static_cast<std::size_t>(rows) * static_cast<std::size_t>(width()));
  if (rows > 0) impl_->rows->read(row, rows, out.data());
}

void RasterSource::read_rows(int row, int rows, std::span<float> out) const {
  assert(row >= 0 && rows >= 0 && row <= height() - rows && float_is_exact());
  assert(out.size() >= static_cast<std::size_t>(rows) * static_cast<std::size_t>(width()));
  if (rows > 0) impl_->rows->read(row, rows, out.data());
}

}  // namespace patchwork
