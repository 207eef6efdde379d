#include "tools/surface_dataset.h"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>

#include "db/error.h"
#include "tools/output_file.h"
#include "tools/threads.h"

// The surface is shown to GDAL as a dataset with overviews whose pixels are made when they are read; its COG
// driver copies that dataset level by level, coarsest first, in the order of the file. Nothing is computed
// twice, kept whole or written to a temporary raster, which the driver does for a source without overviews of
// its own.

namespace patchwork {
namespace {

// Also the height of a strip: one row of tiles is the least that a level read from top to bottom has to keep.
constexpr int kTile = 512;

int divide_up(int a, int b) { return a / b + (a % b != 0); }

// GDAL is C inside: an exception must not cross its frames. The first one is kept here until GDAL has
// unwound.
struct Failure {
  std::exception_ptr thrown;
  std::string message;  // the first error that GDAL reported, which names the cause; later ones only follow

  template <typename Work>
  bool guard(Work&& work) {
    if (thrown) return false;
    try {
      work();
      return true;
    } catch (...) {
      thrown = std::current_exception();
      return false;
    }
  }
};

// The strip of `kTile` rows that GDAL is reading. It reads level after level, each from top to bottom, so
// that one strip for all of them is enough and every strip is made once.
class StripCache {
 public:
  StripCache(const SurfaceRaster& raster, const RowSource& source, Failure& failure)
      : raster_(raster), source_(source), failure_(failure), planes_(raster.bands.size()) {}

  // The first sample of `row` at `factor`; null once the source has thrown. Valid until another strip is
  // asked for.
  const float* row(int factor, int band, int row) {
    if ((factor != factor_ || row / kTile != strip_) && !make(factor, row / kTile)) return nullptr;
    return planes_[size_t(band)].get() + size_t(row % kTile) * size_t(divide_up(raster_.width, factor));
  }

 private:
  bool make(int factor, int strip) {
    const int first = strip * kTile, rows = std::min(kTile, divide_up(raster_.height, factor) - first);
    factor_ = 0;
    if (!failure_.guard([&] { fill(factor, first, rows); })) return false;
    factor_ = factor, strip_ = strip;
    return true;
  }

  void fill(int factor, int first, int rows) {
    const size_t samples = size_t(std::min(kTile, raster_.height)) * size_t(raster_.width);
    std::vector<float*> bands;
    for (auto& plane : planes_) {
      if (!plane) plane.reset(new float[samples]);  // not zeroed: the source writes every sample
      bands.push_back(plane.get());
    }
    source_(factor, first, rows, bands);
  }

  const SurfaceRaster& raster_;
  const RowSource& source_;
  Failure& failure_;
  int factor_ = 0, strip_ = -1;
  std::vector<std::unique_ptr<float[]>> planes_;
};

// One band of one level. GDAL owns it through its dataset.
class LevelBand final : public GDALRasterBand {
 public:
  LevelBand(GDALDataset* owner, int number, int factor, StripCache& strips, const SurfaceBand& about)
      : factor_(factor), strips_(strips), about_(about) {
    poDS = owner;
    nBand = number;
    eDataType = GDT_Float32;
    nBlockXSize = nBlockYSize = kTile;
    nRasterXSize = owner->GetRasterXSize();
    nRasterYSize = owner->GetRasterYSize();
    SetDescription(about.name.c_str());
    for (const auto& [key, value] : about.metadata) SetMetadataItem(key.c_str(), value.c_str());
  }

  void add_overview(GDALRasterBand* band) { overviews_.push_back(band); }

  // Virtual answers instead of GDALPamDataset's setters, which would leave an .aux.xml behind.
  double GetNoDataValue(int* has) override {
    if (has) *has = TRUE;
    return std::numeric_limits<double>::quiet_NaN();
  }
  const char* GetUnitType() override { return about_.unit.c_str(); }
  int GetOverviewCount() override { return int(overviews_.size()); }
  GDALRasterBand* GetOverview(int i) override {
    return i >= 0 && i < GetOverviewCount() ? overviews_[size_t(i)] : nullptr;
  }

  CPLErr IReadBlock(int bx, int by, void* out) override {
    const int cols = std::min(kTile, nRasterXSize - bx * kTile),
              rows = std::min(kTile, nRasterYSize - by * kTile);
    return copy(bx * kTile, by * kTile, cols, rows, static_cast<char*>(out), sizeof(float),
                sizeof(float) * kTile);
  }

  // Whole windows go straight from the strip into the caller's buffer, past GDAL's block cache.
  CPLErr IRasterIO(GDALRWFlag flag, int x, int y, int cols, int rows, void* out, int out_cols, int out_rows,
                   GDALDataType type, GSpacing pixel, GSpacing line, GDALRasterIOExtraArg* extra) override {
    if (flag == GF_Read && type == GDT_Float32 && cols == out_cols && rows == out_rows)
      return copy(x, y, cols, rows, static_cast<char*>(out), pixel, line);
    return GDALRasterBand::IRasterIO(flag, x, y, cols, rows, out, out_cols, out_rows, type, pixel, line,
                                     extra);
  }

 private:
  CPLErr copy(int x, int y, int cols, int rows, char* out, GSpacing pixel, GSpacing line) {
    for (int r = 0; r < rows; ++r, out += line) {
      const float* in = strips_.row(factor_, nBand - 1, y + r);
      if (!in) return CE_Failure;
      copy_row(in + x, cols, out, pixel);
    }
    return CE_None;
  }

  static void copy_row(const float* in, int cols, char* out, GSpacing pixel) {
    if (pixel == sizeof(float)) {
      std::memcpy(out, in, sizeof(float) * size_t(cols));
      return;
    }
    for (int c = 0; c < cols; ++c, out += pixel) std::memcpy(out, in + c, sizeof(float));
  }

  int factor_;
  StripCache& strips_;
  const SurfaceBand& about_;
  std::vector<GDALRasterBand*> overviews_;
};

// One level. Only the full one is asked for its overviews, place and metadata.
class LevelDataset final : public GDALDataset {
 public:
  LevelDataset(const SurfaceRaster& raster, StripCache& strips, int factor) : raster_(raster) {
    nRasterXSize = divide_up(raster.width, factor);
    nRasterYSize = divide_up(raster.height, factor);
    for (size_t b = 0; b < raster.bands.size(); ++b)
      SetBand(int(b) + 1, new LevelBand(this, int(b) + 1, factor, strips, raster.bands[b]));
    // By pixel, the copy takes all bands of a window at once; by band it would read the whole surface once
    // for each.
    GDALDataset::SetMetadataItem("INTERLEAVE", "PIXEL", "IMAGE_STRUCTURE");
    for (const auto& [key, value] : raster.metadata) GDALDataset::SetMetadataItem(key.c_str(), value.c_str());
    crs_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  }

  // False where GDAL does not understand the raster's CRS.
  bool set_crs() {
    return raster_.crs_wkt.empty() || crs_.SetFromUserInput(raster_.crs_wkt.c_str()) == OGRERR_NONE;
  }

  void add_overview(LevelDataset& level) {
    for (int b = 1; b <= nBands; ++b)
      static_cast<LevelBand*>(GetRasterBand(b))->add_overview(level.GetRasterBand(b));
  }

  CPLErr GetGeoTransform(double* out) override {
    std::copy(raster_.geotransform.begin(), raster_.geotransform.end(), out);
    return CE_None;
  }
  const OGRSpatialReference* GetSpatialRef() const override { return crs_.IsEmpty() ? nullptr : &crs_; }

  // Band by band a window over two strips would make the first strip once for each band: split it at the
  // strips.
  CPLErr IRasterIO(GDALRWFlag flag, int x, int y, int cols, int rows, void* out, int out_cols, int out_rows,
                   GDALDataType type, int bands, int* band_map, GSpacing pixel, GSpacing line, GSpacing band,
                   GDALRasterIOExtraArg* extra) override {
    if (flag != GF_Read || cols != out_cols || rows != out_rows)
      return GDALDataset::IRasterIO(flag, x, y, cols, rows, out, out_cols, out_rows, type, bands, band_map,
                                    pixel, line, band, extra);
    for (int top = y; top < y + rows;) {
      const int part = std::min((top / kTile + 1) * kTile, y + rows) - top;
      for (int b = 0; b < bands; ++b) {
        char* to = static_cast<char*>(out) + (top - y) * line + b * band;
        if (GetRasterBand(band_map[b])
                ->RasterIO(GF_Read, x, top, cols, part, to, cols, part, type, pixel, line, nullptr) !=
            CE_None)
          return CE_Failure;
      }
      top += part;
    }
    return CE_None;
  }

 private:
  const SurfaceRaster& raster_;
  OGRSpatialReference crs_;
};

// All levels of the surface; the datasets of the overviews must outlive the full one, which points at their
// bands.
class Pyramid {
 public:
  Pyramid(const SurfaceRaster& raster, const RowSource& source, Failure& failure)
      : strips_(raster, source, failure), full_(raster, strips_, 1) {
    for (int factor : overview_factors(raster.width, raster.height)) {
      overviews_.push_back(std::make_unique<LevelDataset>(raster, strips_, factor));
      full_.add_overview(*overviews_.back());
    }
  }
  LevelDataset& full() { return full_; }

 private:
  StripCache strips_;
  std::vector<std::unique_ptr<LevelDataset>> overviews_;
  LevelDataset full_;
};

void check(const std::string& path, const SurfaceRaster& raster) {
  if (raster.width < 1 || raster.height < 1 || raster.bands.empty())
    throw Error(path, "a raster needs at least one pixel and one band");
  for (double number : raster.geotransform)
    if (!std::isfinite(number)) throw Error(path, "the raster's position or step is not finite");
  // libtiff writes LERC tiles of several interleaved bands with NaN without complaint and cannot read them
  // again.
  if (raster.compression == "LERC" && raster.bands.size() > 1)
    throw Error(path, "LERC cannot hold gaps in a file of several bands",
                "use ZSTD or DEFLATE, or write one band");
  for (const char* known : {"NONE", "DEFLATE", "ZSTD", "LERC"})
    if (raster.compression == known) return;
  throw Error(path, "unknown compression " + raster.compression, "use NONE, DEFLATE, ZSTD or LERC");
}

GDALDriver& cog_driver(const std::string& path) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("COG");
  if (!driver) {
    GDALAllRegister();
    driver = GetGDALDriverManager()->GetDriverByName("COG");
  }
  if (!driver) throw Error(path, "this GDAL cannot write Cloud Optimized GeoTIFFs", "use GDAL 3.1 or later");
  return *driver;
}

// FORCE_USE_EXISTING: every level comes from the source, the driver must not resample its own.
CPLStringList creation_options(const SurfaceRaster& raster) {
  CPLStringList options;
  options.SetNameValue("COMPRESS", raster.compression.c_str());
  options.SetNameValue("OVERVIEW_COMPRESS", raster.compression.c_str());
  options.SetNameValue("BLOCKSIZE", std::to_string(kTile).c_str());
  options.SetNameValue("BIGTIFF", "IF_SAFER");
  options.SetNameValue("NUM_THREADS", std::to_string(allowed_threads()).c_str());
  options.SetNameValue("OVERVIEWS", "FORCE_USE_EXISTING");
  // Level 1: on 4096 x 4096 pixels of Puget Sound level 6 takes twice the time for 3 % (DEFLATE) or 12 %
  // (ZSTD) fewer bytes.
  if (raster.compression == "DEFLATE" || raster.compression == "ZSTD") {
    options.SetNameValue("PREDICTOR", "FLOATING_POINT");
    options.SetNameValue("OVERVIEW_PREDICTOR", "FLOATING_POINT");
    options.SetNameValue("LEVEL", "1");
  }
  return options;
}

// Set for the calling thread; what GDAL merely warns of concerns the file's readers, not this caller.
void keep_first_error(CPLErr severity, CPLErrorNum, const char* message) {
  auto& failure = *static_cast<Failure*>(CPLGetErrorHandlerUserData());
  if (severity >= CE_Failure && failure.message.empty()) failure.message = message;
}

// What GDAL hands back to the progress function.
struct Report {
  const ProgressCallback& tell;
  Failure& failure;
};

int CPL_STDCALL report_progress(double done, const char*, void* data) {
  auto& report = *static_cast<Report*>(data);
  return report.failure.guard([&] {
    if (report.tell) report.tell(std::clamp(done, 0.0, 1.0));
  });
}

}  // namespace

std::vector<int> overview_factors(int width, int height) {
  std::vector<int> factors;
  for (int f = 2; divide_up(std::max(width, height), f / 2) > kTile; f *= 2) factors.push_back(f);
  return factors;
}

void write_cog(const std::string& path, const SurfaceRaster& raster, const RowSource& source,
               const ProgressCallback& progress) {
  check(path, raster);
  GDALDriver& driver = cog_driver(path);
  Failure failure;
  Report report{progress, failure};
  OutputFile file(path);
  Pyramid pyramid(raster, source, failure);
  CPLPushErrorHandlerEx(keep_first_error, &failure);
  if (!pyramid.full().set_crs())
    failure.message = "the CRS is not understood: " + raster.crs_wkt.substr(0, 60);
  // Closing writes what is still buffered: it can fail too, and says so only through the error handler.
  if (failure.message.empty()) {
    GDALDataset* written = driver.CreateCopy(file.name().c_str(), &pyramid.full(), FALSE,
                                             creation_options(raster).List(), report_progress, &report);
    if (written)
      GDALClose(written);
    else if (failure.message.empty())
      failure.message = "GDAL cannot write the file";
  }
  CPLPopErrorHandler();
  if (failure.thrown) std::rethrow_exception(failure.thrown);
  if (!failure.message.empty()) throw Error(path, failure.message);
  file.publish();
}

}  // namespace patchwork
