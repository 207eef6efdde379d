#include "tools/surface_dataset.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "db/error.h"

namespace patchwork {
namespace {

namespace fs = std::filesystem;

// A directory of this test's own, gone with it.
class SurfaceDataset : public testing::Test {
 protected:
  SurfaceDataset() { fs::create_directories(dir_); }
  ~SurfaceDataset() override { fs::remove_all(dir_); }

  std::string path(const std::string& name) const { return (dir_ / name).string(); }
  int files() const { return int(std::distance(fs::directory_iterator(dir_), fs::directory_iterator())); }

  const char* seed_text_ = std::getenv("PATCHWORK_SEED");
  std::uint32_t seed_ =
      seed_text_ ? std::uint32_t(std::strtoul(seed_text_, nullptr, 10)) : std::random_device{}();

 private:
  fs::path dir_ =
      fs::path(testing::TempDir()) / ("surface_" + std::to_string(getpid()) + "_" +
                                      testing::UnitTest::GetInstance()->current_test_info()->name());
};

SurfaceRaster raster(int width, int height, int bands = 1, const std::string& compression = "NONE") {
  SurfaceRaster r{.width = width, .height = height, .geotransform = {500000, 2, 0, 5200000, 0, -2}};
  const char* names[] = {"height", "bound", "source"};
  for (int b = 0; b < bands; ++b) r.bands.push_back({.name = names[b]});
  r.compression = compression;
  return r;
}

// The height that every test expects at a pixel: a hash, one in eight without data.
float truth(std::uint32_t seed, int factor, int band, int row, int col) {
  std::uint64_t h = seed;
  for (int part : {factor, band, row, col}) h = (h ^ std::uint64_t(part)) * 0x9e3779b97f4a7c15u, h ^= h >> 29;
  if (h % 8 == 0) return std::numeric_limits<float>::quiet_NaN();
  return float(h >> 40) * 0.001f - 3000.0f;
}

RowSource truth_rows(std::uint32_t seed, int width) {
  return [=](int factor, int row, int rows, std::span<float* const> bands) {
    const int cols = (width + factor - 1) / factor;
    for (size_t b = 0; b < bands.size(); ++b)
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < cols; ++c)
          bands[b][size_t(r) * size_t(cols) + size_t(c)] = truth(seed, factor, int(b), row + r, c);
  };
}

void any_samples(int, int, int, std::span<float* const>) {}

using Dataset = std::unique_ptr<GDALDataset, void (*)(GDALDataset*)>;
Dataset open(const std::string& path) {
  GDALAllRegister();
  return {GDALDataset::Open(path.c_str(), GDAL_OF_RASTER), [](GDALDataset* d) { GDALClose(d); }};
}

std::int64_t tiff_item(GDALRasterBand* band, const char* key) {
  const char* value = band->GetMetadataItem(key, "TIFF");
  return value ? std::atoll(value) : -1;
}

// What makes a TIFF cloud optimized, in the terms of GDAL's validator: tiles, overviews for whatever exceeds
// a tile, every directory before all data, and the data of each level before that of the next finer one.
std::string cog_violation(GDALDataset& file) {
  GDALRasterBand* band = file.GetRasterBand(1);
  int bx, by;
  band->GetBlockSize(&bx, &by);
  if (bx != 512 || by != 512) return "not tiled by 512";
  const int overviews = band->GetOverviewCount();
  if (overviews == 0 && std::max(file.GetRasterXSize(), file.GetRasterYSize()) > 512) return "no overviews";
  if (tiff_item(band, "IFD_OFFSET") > 300) return "the first directory is not at the start";
  std::int64_t directory = tiff_item(band, "IFD_OFFSET"), data = tiff_item(band, "BLOCK_OFFSET_0_0");
  for (int o = 0; o < overviews; ++o) {
    GDALRasterBand* level = band->GetOverview(o);
    if (tiff_item(level, "IFD_OFFSET") <= directory) return "directories out of order";
    if (tiff_item(level, "BLOCK_OFFSET_0_0") >= data) return "coarse data after finer data";
    directory = tiff_item(level, "IFD_OFFSET"), data = tiff_item(level, "BLOCK_OFFSET_0_0");
  }
  return directory < data ? "" : "data before a directory";
}

TEST_F(SurfaceDataset, IsACloudOptimizedGeoTiffWhateverTheSize) {
  const std::pair<int, int> sizes[] = {{1, 1}, {7, 1}, {512, 512}, {513, 1}, {1, 1030}, {1300, 700}};
  for (const char* compression : {"NONE", "DEFLATE", "ZSTD", "LERC"})
    for (auto [width, height] : sizes) {
      const std::string name = path("cog.tif");
      write_cog(name, raster(width, height, 1, compression), truth_rows(1, width));
      const Dataset file = open(name);
      ASSERT_TRUE(file);
      EXPECT_EQ(cog_violation(*file), "") << compression << ' ' << width << 'x' << height;
      EXPECT_STREQ(file->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
      EXPECT_EQ(files(), 1) << "nothing is left beside the file";
    }
}

TEST_F(SurfaceDataset, LayoutCheckRefusesOverviewsAddedLater) {
  GDALAllRegister();
  char tiled[] = "TILED=YES", x[] = "BLOCKXSIZE=512", y[] = "BLOCKYSIZE=512";
  char* options[] = {tiled, x, y, nullptr};
  GDALDataset* plain = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path("plain.tif").c_str(), 1300, 700, 1, GDT_Float32, options);
  plain->GetRasterBand(1)->Fill(1);
  plain->FlushCache();
  EXPECT_EQ(cog_violation(*plain), "no overviews");
  int factor = 2;
  plain->BuildOverviews("NEAREST", 1, &factor, 0, nullptr, nullptr, nullptr);
  GDALClose(plain);
  EXPECT_NE(cog_violation(*open(path("plain.tif"))), "");
}

TEST_F(SurfaceDataset, EverySampleOfEveryLevelComesBackBitForBit) {
  std::cout << "PATCHWORK_SEED=" << seed_ << '\n';
  const int width = 1100, height = 1041;
  for (const char* compression : {"NONE", "DEFLATE", "ZSTD", "LERC"})
    for (int bands : {1, 3}) {
      if (bands > 1 && compression == std::string("LERC")) continue;  // refused, see below
      write_cog(path("bits.tif"), raster(width, height, bands, compression), truth_rows(seed_, width));
      const Dataset file = open(path("bits.tif"));
      int wrong = 0, shifted = 0;
      for (int b = 1; b <= bands; ++b)
        for (int level = 0; level <= 2; ++level) {
          GDALRasterBand* full = file->GetRasterBand(b);
          GDALRasterBand* band = level == 0 ? full : full->GetOverview(level - 1);
          const int cols = band->GetXSize(), rows = band->GetYSize();
          ASSERT_EQ(cols, (width + (1 << level) - 1) >> level);
          ASSERT_EQ(rows, (height + (1 << level) - 1) >> level);
          std::vector<float> read(size_t(cols) * size_t(rows));
          ASSERT_EQ(CE_None,
                    band->RasterIO(GF_Read, 0, 0, cols, rows, read.data(), cols, rows, GDT_Float32, 0, 0));
          for (size_t k = 0; k < read.size(); ++k) {
            const int row = int(k) / cols, col = int(k) % cols;
            const auto differs = [&](float expected) {
              return std::isnan(expected)
                         ? !std::isnan(read[k])
                         : std::bit_cast<std::uint32_t>(expected) != std::bit_cast<std::uint32_t>(read[k]);
            };
            wrong += differs(truth(seed_, 1 << level, b - 1, row, col));
            shifted += differs(truth(seed_, 1 << level, b - 1, row, col + 1));
          }
        }
      EXPECT_EQ(wrong, 0) << compression << ", bands " << bands;
      EXPECT_GT(shifted, 1000000) << "the comparison must see a shift by one pixel";
    }
}

TEST_F(SurfaceDataset, EveryRowOfEveryLevelIsMadeOnceFromTheCoarsestDown) {
  const int width = 700, height = 2100;
  for (int bands : {1, 3}) {
    std::map<int, int> next;
    int last_factor = 1 << 30;
    write_cog(path("once.tif"), raster(width, height, bands), [&](int factor, int row, int rows, auto out) {
      EXPECT_EQ(int(out.size()), bands);
      EXPECT_LE(factor, last_factor);
      EXPECT_EQ(row, next[factor]) << "factor " << factor;
      next[factor] += rows, last_factor = factor;
    });
    EXPECT_EQ(next, (std::map<int, int>{{1, 2100}, {2, 1050}, {4, 525}, {8, 263}}));
  }
}

TEST_F(SurfaceDataset, OverviewFactorsEndWhereOneTileHoldsTheRaster) {
  EXPECT_EQ(overview_factors(512, 512), std::vector<int>());
  EXPECT_EQ(overview_factors(513, 1), std::vector<int>({2}));
  EXPECT_EQ(overview_factors(1025, 3), std::vector<int>({2, 4}));
  EXPECT_EQ(overview_factors(4096, 4096), std::vector<int>({2, 4, 8}));
}

TEST_F(SurfaceDataset, SaysWhereItLiesAndWhatItHolds) {
  SurfaceRaster about = raster(600, 40, 2);
  about.geotransform = {10, 1.5, 0.5, 20, 0.5, -1.5};
  about.crs_wkt = "EPSG:32610";
  about.metadata = {{"PATCHWORK_ERROR", "5"}};
  about.bands[0].metadata = {{"BOUND_MAX", "4.5"}};
  about.bands[1].unit = "";
  write_cog(path("facts.tif"), about, truth_rows(2, 600));
  const Dataset file = open(path("facts.tif"));
  std::array<double, 6> gt{};
  ASSERT_EQ(file->GetGeoTransform(gt.data()), CE_None);
  EXPECT_EQ(gt, about.geotransform);
  EXPECT_STREQ(file->GetSpatialRef()->GetAuthorityCode(nullptr), "32610");
  EXPECT_STREQ(file->GetMetadataItem("PATCHWORK_ERROR"), "5");
  EXPECT_STREQ(file->GetRasterBand(1)->GetMetadataItem("BOUND_MAX"), "4.5");
  EXPECT_EQ(file->GetRasterBand(2)->GetMetadataItem("BOUND_MAX"), nullptr);
  EXPECT_STREQ(file->GetRasterBand(1)->GetDescription(), "height");
  EXPECT_STREQ(file->GetRasterBand(2)->GetDescription(), "bound");
  EXPECT_STREQ(file->GetRasterBand(1)->GetUnitType(), "m");
  EXPECT_STREQ(file->GetRasterBand(2)->GetUnitType(), "");
  int has_nodata = 0;
  EXPECT_TRUE(std::isnan(file->GetRasterBand(1)->GetNoDataValue(&has_nodata)));
  EXPECT_TRUE(has_nodata);
}

TEST_F(SurfaceDataset, WithoutACrsNoneIsWritten) {
  write_cog(path("bare.tif"), raster(3, 3), truth_rows(3, 3));
  EXPECT_EQ(open(path("bare.tif"))->GetSpatialRef(), nullptr);
}

TEST_F(SurfaceDataset, ProgressRisesToOne) {
  double last = 0;
  write_cog(path("p.tif"), raster(1200, 1200), any_samples, [&](double done) {
    EXPECT_GE(done, last);
    last = done;
  });
  EXPECT_EQ(last, 1);
}

TEST_F(SurfaceDataset, WhatTheSourceOrTheProgressThrowsPassesThroughAndTheOldFileStays) {
  std::ofstream(path("kept.tif")) << "old";
  const auto fail_late = [](int factor, int row, int, std::span<float* const>) {
    if (factor == 1 && row > 0) throw std::domain_error("late");
  };
  EXPECT_THROW(write_cog(path("kept.tif"), raster(600, 1200), fail_late), std::domain_error);
  const auto stop = [](double done) {
    if (done > 0.5) throw std::domain_error("stopped");
  };
  EXPECT_THROW(write_cog(path("kept.tif"), raster(600, 1200), any_samples, stop), std::domain_error);
  EXPECT_EQ(files(), 1);
  EXPECT_EQ(fs::file_size(path("kept.tif")), 3u);
  write_cog(path("kept.tif"), raster(600, 1200), any_samples);
  EXPECT_GT(fs::file_size(path("kept.tif")), 1000000u) << "without a failure the old file is replaced";
}

// The message of the Error, or "" where none was thrown.
std::string refusal(const std::string& path, const SurfaceRaster& about) {
  try {
    write_cog(path, about, any_samples);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST_F(SurfaceDataset, RefusesWhatCannotBeWrittenNamingTheFile) {
  SurfaceRaster odd = raster(9, 9);
  EXPECT_EQ(refusal(path("good.tif"), odd), "");
  odd.compression = "JPEG";
  EXPECT_NE(refusal(path("x.tif"), odd).find("x.tif: unknown compression JPEG"), std::string::npos);
  EXPECT_NE(refusal(path("x.tif"), raster(9, 9, 2, "LERC")).find("LERC cannot hold gaps"), std::string::npos);
  odd = raster(9, 9);
  odd.crs_wkt = "EPSG:0";
  EXPECT_NE(refusal(path("x.tif"), odd).find("CRS is not understood"), std::string::npos);
  odd = raster(9, 9);
  odd.geotransform[1] = std::nan("");
  EXPECT_NE(refusal(path("x.tif"), odd).find("not finite"), std::string::npos);
  EXPECT_NE(refusal(path("x.tif"), raster(0, 9)), "");
  EXPECT_NE(refusal(path("x.tif"), raster(9, 9, 0)), "");
  EXPECT_NE(refusal(path("no/such/x.tif"), raster(9, 9)).find("no/such/x.tif: "), std::string::npos);
  fs::create_directories(path("folder/child"));
  EXPECT_NE(refusal(path("folder"), raster(9, 9)).find("it is a folder"), std::string::npos);
  EXPECT_EQ(files(), 2) << "good.tif and the folder, no partial file";
}

TEST_F(SurfaceDataset, AFullDiskIsAnErrorAndLeavesNothing) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (rlim_t limit : {rlim_t(100), rlim_t(5000), rlim_t(1 << 20), rlim_t(5 << 20)}) {
    const rlimit small{limit, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    const std::string said = refusal(path("full.tif"), raster(1024, 1024));
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_NE(said.find("full.tif: "), std::string::npos) << limit;
    EXPECT_EQ(files(), 0) << limit;
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(refusal(path("full.tif"), raster(1024, 1024)), "");
}

}  // namespace
}  // namespace patchwork
