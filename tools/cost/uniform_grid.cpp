#include "tools/cost/uniform_grid.h"

#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "db/error.h"
#include "db/stopwatch.h"
#include "tools/resampler.h"

namespace patchwork::cli {

namespace {

constexpr int kFewBlocks = 512;  // pixels along a side: four blocks of the file

GDALDatasetUniquePtr create(const std::string& path, int width, int height) {
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const char* const options[] = {"TILED=YES",   "COMPRESS=ZSTD",        "ZSTD_LEVEL=1",
                                 "PREDICTOR=3", "NUM_THREADS=ALL_CPUS", "BIGTIFF=IF_SAFER",
                                 nullptr};
  GDALDatasetUniquePtr file(
      driver ? driver->Create(path.c_str(), width, height, 1, GDT_Float32, const_cast<char**>(options))
             : nullptr);
  if (!file) throw Error(path, "GDAL cannot make the uniform grid");
  file->GetRasterBand(1)->SetNoDataValue(NAN);
  return file;
}

// As one would who knows the file: no other driver is asked, and the folder is not searched. `threads`: to
// start them takes longer than to read a level of a few blocks.
GDALDatasetUniquePtr open_level(const std::string& path, int level, bool threads) {
  const std::string only = level > 0 ? std::to_string(level - 1) + " only" : "NONE",
                    overview = "OVERVIEW_LEVEL=" + only;
  const char* const options[] = {threads ? "NUM_THREADS=ALL_CPUS" : "NUM_THREADS=1", overview.c_str(),
                                 nullptr};
  const char *const drivers[] = {"GTiff", nullptr}, *const beside_it[] = {nullptr};
  GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER, drivers, options, beside_it));
  if (!file) throw Error(path, "GDAL cannot open the uniform grid");
  return file;
}

void check(CPLErr error, const std::string& path) {
  if (error != CE_None) throw Error(path, CPLGetLastErrorMsg());
}

}  // namespace

// Heights at the check points, bilinear between the pixels' centres.
struct UniformGrid::Level {
  int width, height, factor;
  std::vector<double> at_points;

  Level(const std::string& path, int level, const Extent& e, const CheckPoints& points) : factor(1 << level) {
    const GDALDatasetUniquePtr file = open_level(path, level, true);
    width = file->GetRasterXSize(), height = file->GetRasterYSize();
    std::vector<float> v(std::size_t(width) * std::size_t(height));
    check(file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, v.data(), width, height, GDT_Float32,
                                           0, 0, nullptr),
          path);
    const auto at = [&](int i, int j) {
      return double(v[std::size_t(std::clamp(j, 0, height - 1)) * std::size_t(width) +
                      std::size_t(std::clamp(i, 0, width - 1))]);
    };
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double u = (points.x()[k] - e.xmin) / (e.xmax - e.xmin) * width - 0.5,
                   w = (e.ymax - points.y()[k]) / (e.ymax - e.ymin) * height - 0.5;
      const int i = int(std::floor(u)), j = int(std::floor(w));
      const double s = u - i, t = w - j;
      at_points.push_back((1 - t) * ((1 - s) * at(i, j) + s * at(i + 1, j)) +
                          t * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1)));
    }
  }
};

UniformGrid::UniformGrid(const Database& db, const Extent& extent, const CheckPoints& points,
                         const std::string& path, std::uint64_t memory)
    : points_(points), path_(path) {
  GDALAllRegister();
  const double finest = finest_step(db, extent),
               longer = std::max(extent.xmax - extent.xmin, extent.ymax - extent.ymin);
  const double most = std::min(double(kMostSide), std::sqrt(double(memory / 4 / sizeof(float))));
  step_ = std::max(finest, longer / most), complete_ = step_ == finest;
  const Raster raster = Raster::covering(extent, step_);
  extent_ = raster.extent();
  const Extraction all = extract(db, {.error = 0, .region = Region::inside(extent_)});
  std::vector<float> heights(std::size_t(raster.width) * std::size_t(raster.height));
  Blend(db, all.patches, {})
      .at_pixels(raster.frame(), raster.width, 0, raster.height,
                 {.height = {}, .bound = {}, .source = {}, .patch = {}, .height32 = heights});
  int levels = 1;
  {
    const GDALDatasetUniquePtr file = create(path, raster.width, raster.height);
    check(file->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, raster.width, raster.height, heights.data(),
                                           raster.width, raster.height, GDT_Float32, 0, 0, nullptr),
          path);
  }
  {
    // Opened anew, and on one thread: GDAL's overviews read what they wrote, and its reading threads wait for
    // ever for writing ones where a block of the one drives out a block of the other (3.6).
    const GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    if (!file) throw Error(path, "GDAL cannot open the uniform grid");
    std::vector<int> factors;
    for (int f = 2; std::max(raster.width, raster.height) / f >= 2; f *= 2) factors.push_back(f);
    check(file->BuildOverviews("BILINEAR", int(factors.size()), factors.data(), 0, nullptr, nullptr, nullptr),
          path);
    levels += int(factors.size());
  }
  for (int level = 0; level < levels; ++level) levels_.emplace_back(path, level, extent_, points);
}

UniformGrid::~UniformGrid() = default;

int UniformGrid::levels() const { return int(levels_.size()); }
int UniformGrid::factor(int level) const { return levels_[std::size_t(level)].factor; }
std::size_t UniformGrid::bytes(int level) const {
  const Level& l = levels_[std::size_t(level)];
  return sizeof(float) * std::size_t(l.width) * std::size_t(l.height);
}
std::size_t UniformGrid::file_bytes() const { return std::filesystem::file_size(path_); }

ErrorFigures UniformGrid::error(int level, std::span<const double> scale) const {
  return points_.figures(levels_[std::size_t(level)].at_points, scale);
}

double UniformGrid::read(int level, const Extent& window, int side) const {
  const Level& l = levels_[std::size_t(level)];
  const double sx = l.width / (extent_.xmax - extent_.xmin), sy = l.height / (extent_.ymax - extent_.ymin);
  GDALRasterIOExtraArg how;
  INIT_RASTERIO_EXTRA_ARG(how);
  how.bFloatingPointWindowValidity = TRUE;
  how.dfXOff = std::clamp((window.xmin - extent_.xmin) * sx, 0., l.width - 1.);
  how.dfYOff = std::clamp((extent_.ymax - window.ymax) * sy, 0., l.height - 1.);
  how.dfXSize = std::clamp((window.xmax - window.xmin) * sx, 1., l.width - how.dfXOff);
  how.dfYSize = std::clamp((window.ymax - window.ymin) * sy, 1., l.height - how.dfYOff);
  const int x = int(how.dfXOff), y = int(how.dfYOff);
  const int width = std::clamp(int(std::ceil(how.dfXOff + how.dfXSize)) - x, 1, l.width - x),
            height = std::clamp(int(std::ceil(how.dfYOff + how.dfYSize)) - y, 1, l.height - y);
  if (how.dfXSize < side) how.eResampleAlg = GRIORA_Bilinear;
  std::vector<float> out(std::size_t(side) * std::size_t(side));
  const GDALDatasetUniquePtr file = open_level(path_, level, std::max(width, height) > kFewBlocks);
  const Stopwatch watch;
  check(file->GetRasterBand(1)->RasterIO(GF_Read, x, y, width, height, out.data(), side, side, GDT_Float32, 0,
                                         0, &how),
        path_);
  return watch.milliseconds();
}

}  // namespace patchwork::cli
