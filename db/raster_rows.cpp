// How GDAL's messages are kept, and how the rows of one file are read and freed of what is no height.
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "db/raster_impl.h"

namespace patchwork::raster_impl {

GdalMessages::GdalMessages() {
  static std::once_flag once;
  std::call_once(once, [] { GDALAllRegister(); });
  CPLPushErrorHandlerEx([](CPLErr level, CPLErrorNum number, const char* text) { keep(level, number, text); },
                        this);
  // Debug output stays with GDAL: a person who sets CPL_DEBUG wants to see it.
  CPLSetCurrentErrorHandlerCatchDebug(FALSE);
}

GdalMessages::~GdalMessages() { CPLPopErrorHandler(); }

void GdalMessages::keep(CPLErr level, CPLErrorNum, const char* text) {
  auto* const self = static_cast<GdalMessages*>(CPLGetErrorHandlerUserData());
  self->failed_ = self->failed_ || level >= CE_Failure;
  self->last_ = text;
  std::replace(self->last_.begin(), self->last_.end(), '\n', ' ');  // an Error is one line
}

std::string GdalMessages::explain(const std::string& problem) const {
  return last_.empty() ? problem : problem + " (GDAL: " + last_ + ")";
}

// GDAL 3.6 knows signed bytes only as bytes with this mark.
bool is_signed_byte(GDALRasterBand& band) {
  const char* const type = band.GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE");
  return band.GetRasterDataType() == GDT_Byte && type && EQUAL(type, "SIGNEDBYTE");
}

namespace {

// Rows of one band of an open file.
class FileRows final : public Rows {
 public:
  FileRows(std::string path, GDALDatasetUniquePtr dataset, int band, std::vector<double> nodata)
      : path_(std::move(path)),
        dataset_(std::move(dataset)),
        band_(dataset_->GetRasterBand(band)),
        nodata_(std::move(nodata)),
        floating_(!GDALDataTypeIsInteger(band_->GetRasterDataType())),
        signed_byte_(is_signed_byte(*band_)) {
    const int flags = band_->GetMaskFlags();
    const bool computed = (flags & GMF_NODATA) && !(flags & GMF_PER_DATASET);
    if (!(flags & GMF_ALL_VALID) && !computed) mask_ = band_->GetMaskBand();
    hold_a_row_of_blocks();
  }
  void read(int row, int rows, double* out) override { read_as(GDT_Float64, row, rows, out); }
  void read(int row, int rows, float* out) override { read_as(GDT_Float32, row, rows, out); }

 private:
  template <typename T>
  void read_as(GDALDataType type, int row, int rows, T* out) {
    const std::size_t count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(band_->GetXSize());
    fetch(*band_, row, rows, out, type);
    if (signed_byte_) std::for_each(out, out + count, [](T& v) { v = v > T(127) ? v - T(256) : v; });
    void_nodata(out, count);
    if (mask_) apply_mask(row, rows, out, count);
  }

  void fetch(GDALRasterBand& band, int row, int rows, void* out, GDALDataType type) {
    const GdalMessages messages;
    const CPLErr result = band.RasterIO(GF_Read, 0, row, band.GetXSize(), rows, out, band.GetXSize(), rows,
                                        type, 0, 0, nullptr);
    if (result != CE_None || messages.failed())
      throw Error(path_,
                  messages.explain("ends early or is damaged near rows " + std::to_string(row) + " to " +
                                   std::to_string(row + rows - 1)),
                  "get the file again");
  }

  // Strips are lower than blocks may be: without room for a row of them each would be decoded several times.
  void hold_a_row_of_blocks() const {
    int width = 0, height = 0;
    band_->GetBlockSize(&width, &height);
    const GIntBig row =
        GIntBig(height) * (band_->GetXSize() + width) * GDALGetDataTypeSizeBytes(band_->GetRasterDataType());
    if (GDALGetCacheMax64() < 2 * row) GDALSetCacheMax64(2 * row);
  }

  // Written as selections over whole arrays: compilers turn them into vector code.
  template <typename T>
  void void_nodata(T* out, std::size_t count) const {
    constexpr T none = std::numeric_limits<T>::quiet_NaN(), largest = std::numeric_limits<T>::max();
    if (floating_)
      for (std::size_t k = 0; k < count; ++k) out[k] = std::abs(out[k]) <= largest ? out[k] : none;
    for (const double value : nodata_) {
      const T sample = static_cast<T>(value);
      for (std::size_t k = 0; k < count; ++k) out[k] = out[k] == sample ? none : out[k];
    }
  }

  template <typename T>
  void apply_mask(int row, int rows, T* out, std::size_t count) {
    mask_bytes_.resize(count);
    fetch(*mask_, row, rows, mask_bytes_.data(), GDT_Byte);
    for (std::size_t k = 0; k < count; ++k)
      if (!mask_bytes_[k]) out[k] = std::numeric_limits<T>::quiet_NaN();
  }

  std::string path_;
  GDALDatasetUniquePtr dataset_;
  GDALRasterBand* band_;
  GDALRasterBand* mask_ = nullptr;
  std::vector<double> nodata_;
  std::vector<unsigned char> mask_bytes_;
  bool floating_, signed_byte_;
};

}  // namespace

std::unique_ptr<Rows> make_file_rows(const std::string& path, GDALDatasetUniquePtr dataset, int band,
                                     const std::vector<double>& nodata) {
  return std::make_unique<FileRows>(path, std::move(dataset), band, nodata);
}

}  // namespace patchwork::raster_impl
