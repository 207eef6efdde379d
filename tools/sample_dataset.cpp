#include "tools/sample_dataset.h"

#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "db/error.h"
#include "tools/output_file.h"
#include "tools/threads.h"

namespace patchwork {

namespace {

constexpr int kRows = 2 * kChunkVertices;  // a row of the file's tiles, so that each is written once

struct Range {
  double low = INFINITY, high = -INFINITY;
  bool holes = false, nodata = false;  // nodata: some sample has the value that meant no data in the file
};

class SampleWriter {
 public:
  SampleWriter(const Database& db, const GridInfo& grid, const std::function<void(double)>& progress)
      : db_(db), grid_(grid), progress_(progress) {}

  std::string write(const std::string& path) {
    GDALAllRegister();
    // Only holes and bytes, which may turn out to be signed, ask for all samples beforehand.
    const bool twice = grid_.holes || grid_.sample_type == GDALGetDataTypeName(GDT_Byte);
    if (twice) each_strip(0, 0.5, [&](int, std::span<const double> strip) { note(strip); });
    from_ = twice ? 0.5 : 0;
    choose();
    OutputFile file(path);
    fill(path, file.name());
    file.publish();
    return GDALGetDataTypeName(type_);
  }

 private:
  int width() const { return grid_.shape.width(); }
  int height() const { return grid_.shape.height(); }

  template <class Visit>
  void each_strip(double from, double to, Visit visit) {
    std::vector<double> strip(size_t(kRows) * size_t(width()));
    for (int row = 0; row < height(); row += kRows) {
      const int rows = std::min(kRows, height() - row);
      const std::span<double> samples(strip.data(), size_t(rows) * size_t(width()));
      db_.read_samples(grid_.id, row, rows, samples);
      visit(row, samples);
      if (progress_) progress_(from + (to - from) * double(row + rows) / height());
    }
  }
  void note(std::span<const double> strip) {
    for (const double v : strip) {
      if (std::isnan(v))
        range_.holes = true;
      else
        range_.low = std::min(range_.low, v), range_.high = std::max(range_.high, v);
      range_.nodata |=
          grid_.nodata && float(v) == float(*grid_.nodata);  // a sample is where it was rounded to
    }
  }

  // The type of the file that was imported; signed bytes, which GDAL did not always know, get 16 bits.
  void choose() {
    type_ = GDALGetDataTypeByName(grid_.sample_type.c_str());
    if (type_ == GDT_Unknown || (grid_.quantisation > 0 && GDALDataTypeIsInteger(type_))) type_ = GDT_Float64;
    const bool below = range_.low < 0 || (range_.holes && grid_.nodata.value_or(0) < 0);
    if (type_ == GDT_Byte && below) type_ = GDT_Int16;
    if (!range_.holes) return;
    if (!range_.nodata) nodata_ = grid_.nodata;
    if (nodata_) return;
    if (!GDALDataTypeIsInteger(type_)) {
      nodata_ = std::numeric_limits<double>::quiet_NaN();
    } else {  // holes of a mask: a value that no sample has
      const int bits = GDALGetDataTypeSizeBits(type_);
      const bool is_signed = GDALDataTypeIsSigned(type_);
      const double least = is_signed ? -std::ldexp(1, bits - 1) : 0,
                   most = std::ldexp(1, is_signed ? bits - 1 : bits) - 1;
      nodata_ = range_.low > least ? least : most;
      if (range_.low <= least && range_.high >= most) type_ = GDT_Float64, nodata_ = std::nan("");
    }
  }

  void fill(const std::string& path, const std::string& name) {
    CPLStringList options;
    options.SetNameValue("TILED", "YES").SetNameValue("COMPRESS", "DEFLATE");
    options.SetNameValue("BLOCKYSIZE", std::to_string(kRows).c_str());
    options.SetNameValue("PREDICTOR", GDALDataTypeIsInteger(type_) ? "2" : "3");
    options.SetNameValue("BIGTIFF", "IF_SAFER");
    options.SetNameValue("NUM_THREADS", std::to_string(allowed_threads()).c_str());
    const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);
    GDALDatasetUniquePtr out(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        name.c_str(), width(), height(), 1, type_, options.List()));
    const auto expect = [&](bool good) {
      if (!good) throw Error(path, std::string("it cannot be written: ") + CPLGetLastErrorMsg());
    };
    expect(out != nullptr && describe(*out));
    each_strip(from_, 1, [&](int row, std::span<const double> strip) {
      std::vector<double> values(strip.begin(), strip.end());
      for (double& v : values)
        if (std::isnan(v)) v = *nodata_;
      const int rows = int(values.size() / size_t(width()));
      expect(out->GetRasterBand(1)->RasterIO(GF_Write, 0, row, width(), rows, values.data(), width(), rows,
                                             GDT_Float64, 0, 0, nullptr) == CE_None);
    });
    CPLErrorReset();
    out.reset();  // writes the last blocks: what fails is only told as an error
    expect(CPLGetLastErrorType() < CE_Failure);
  }

  bool describe(GDALDataset& out) const {
    const auto& n = grid_.frame.numbers();
    double geotransform[] = {n[0] - (n[1] + n[2]) / 2, n[1], n[2], n[3] - (n[4] + n[5]) / 2, n[4], n[5]};
    bool good = out.SetGeoTransform(geotransform) == CE_None;
    if (!db_.crs().empty()) good = good && out.SetProjection(db_.crs().c_str()) == CE_None;
    if (!grid_.shape.pixel_is_area()) out.SetMetadataItem("AREA_OR_POINT", "Point");
    GDALRasterBand& band = *out.GetRasterBand(1);
    if (nodata_) good = good && band.SetNoDataValue(*nodata_) == CE_None;
    if (grid_.raw_scale != 1) good = good && band.SetScale(grid_.raw_scale) == CE_None;
    if (grid_.base != 0) good = good && band.SetOffset(grid_.base) == CE_None;
    band.SetUnitType("m");
    return good;
  }

  const Database& db_;
  const GridInfo& grid_;
  const std::function<void(double)>& progress_;
  Range range_;
  double from_ = 0;  // the share that is done when writing begins
  GDALDataType type_ = GDT_Unknown;
  std::optional<double> nodata_;
};

}  // namespace

std::string write_samples(const Database& db, const GridInfo& grid, const std::string& path,
                          const std::function<void(double)>& progress) {
  return SampleWriter(db, grid, progress).write(path);
}

}  // namespace patchwork
