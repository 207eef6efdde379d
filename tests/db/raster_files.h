// Raster files that tests make for themselves, through GDAL, in a directory that goes with the test.
#pragma once

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "db/error.h"
#include "db/raster.h"

namespace patchwork {

inline constexpr double kNoData = std::numeric_limits<double>::quiet_NaN();

/// What a test's file holds; the defaults are a good 4 x 3 grid of 10 m in UTM zone 10.
struct RasterFile {
  int width = 4, height = 3, bands = 1;
  GDALDataType type = GDT_Float32;
  std::array<double, 6> geotransform{500000, 10, 0, 5000000, 0, -10};
  bool georeferenced = true;
  std::string crs = "EPSG:26710";
  std::string driver = "GTiff";
  std::vector<std::string> creation = {};
  std::optional<double> nodata = {};
  std::string unit = {};
  std::optional<double> scale = {}, offset = {};
  bool point = false;
  std::function<double(int, int)> at = [](int i, int j) { return 100.0 * j + i; };
};

class RasterTest : public ::testing::Test {
 protected:
  RasterTest() {
    std::string name = (std::filesystem::temp_directory_path() / "raster-test-XXXXXX").string();
    if (!mkdtemp(name.data())) std::abort();
    directory_ = name;
    GDALAllRegister();
  }
  ~RasterTest() override { std::filesystem::remove_all(directory_); }

  std::string in_directory(const std::string& name) const { return (directory_ / name).string(); }

  /// `also` may change the dataset before it is closed.
  std::string make(const RasterFile& file, const std::string& name = "grid.tif",
                   const std::function<void(GDALDataset&)>& also = {}) const {
    const std::string path = in_directory(name);
    CPLStringList creation;
    for (const auto& option : file.creation) creation.AddString(option.c_str());
    GDALDatasetUniquePtr dataset(
        GetGDALDriverManager()
            ->GetDriverByName(file.driver.c_str())
            ->Create(path.c_str(), file.width, file.height, file.bands, file.type, creation.List()));
    EXPECT_TRUE(dataset);
    describe(file, *dataset);
    for (int b = 1; b <= file.bands; ++b) fill(file, *dataset->GetRasterBand(b));
    if (also) also(*dataset);
    return path;
  }

  static RasterSource open(const std::string& path, const RasterOptions& options = {},
                           const std::string& crs = {}) {
    return RasterSource::open(path, options, crs);
  }

  /// All raw samples, read `rows` at a time.
  static std::vector<double> samples(const RasterSource& source, int rows = 1) {
    std::vector<double> all;
    for (int j = 0; j < source.height(); j += rows) {
      const int n = std::min(rows, source.height() - j);
      std::vector<double> band(static_cast<std::size_t>(n * source.width()));
      source.read_rows(j, n, band);
      all.insert(all.end(), band.begin(), band.end());
    }
    return all;
  }

  /// What opening (and reading all of) the file is refused with; empty where it is not.
  static std::string refusal(const std::string& path, const RasterOptions& options = {},
                             const std::string& crs = {}) {
    return refusal([&] { samples(open(path, options, crs)); });
  }
  static std::string refusal(const std::function<void()>& act) {
    try {
      act();
    } catch (const Error& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "an Error is one line";
      return e.what();
    }
    return {};
  }

  static std::string joined_warnings(const RasterSource& source) {
    std::string all;
    for (const auto& w : source.warnings()) all += w + "\n";
    return all;
  }

  static unsigned seed() {
    const char* const given = std::getenv("PATCHWORK_SEED");
    const unsigned s =
        given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    std::cout << "PATCHWORK_SEED=" << s << "\n";
    return s;
  }

 private:
  static void describe(const RasterFile& file, GDALDataset& dataset) {
    if (file.georeferenced) {
      auto gt = file.geotransform;
      dataset.SetGeoTransform(gt.data());
    }
    if (!file.crs.empty()) {
      OGRSpatialReference crs;
      EXPECT_EQ(crs.SetFromUserInput(file.crs.c_str()), OGRERR_NONE);
      dataset.SetSpatialRef(&crs);
    }
    if (file.point) dataset.SetMetadataItem("AREA_OR_POINT", "Point");
    for (int b = 1; b <= file.bands; ++b) {
      GDALRasterBand& band = *dataset.GetRasterBand(b);
      if (file.nodata) band.SetNoDataValue(*file.nodata);
      if (!file.unit.empty()) band.SetUnitType(file.unit.c_str());
      if (file.scale) band.SetScale(*file.scale);
      if (file.offset) band.SetOffset(*file.offset);
    }
  }

  static void fill(const RasterFile& file, GDALRasterBand& band) {
    std::vector<double> row(static_cast<std::size_t>(file.width));
    for (int j = 0; j < file.height; ++j) {
      for (int i = 0; i < file.width; ++i) row[static_cast<std::size_t>(i)] = file.at(i, j);
      EXPECT_EQ(
          band.RasterIO(GF_Write, 0, j, file.width, 1, row.data(), file.width, 1, GDT_Float64, 0, 0, nullptr),
          CE_None);
    }
  }

  std::filesystem::path directory_;
};

/// True where `text` holds `part`; a failed expectation shows the text.
#define EXPECT_SAYS(text, part) EXPECT_PRED2(::patchwork::says, std::string(text), std::string(part))
inline bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace patchwork
