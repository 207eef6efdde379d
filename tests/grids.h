// Small height grids that tests write as GeoTIFFs and import into databases of their own.
#pragma once

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "db/database.h"
#include "db/error.h"
#include "db/raster.h"

namespace patchwork {

inline constexpr double kHole = std::numeric_limits<double>::quiet_NaN();

/// What a test's grid holds; without a CRS. A NaN is written as `nodata` where that is given.
struct GridFile {
  int width = 40, height = 30;
  std::array<double, 6> geotransform{0, 10, 0, 0, 0, -10};  ///< as GDAL has it, of pixel corners
  bool pixel_is_area = true;
  GDALDataType type = GDT_Float32;
  std::optional<double> nodata = {};
  double accuracy = 0.1;                                              ///< metres
  std::function<double(int, int)> at = [](int, int) { return 0.0; };  ///< height at sample (i, j)
};

/// Pixel corner (0, 0) at (x, y), the i axis turned by `degrees`, the j axis 90 degrees clockwise of it.
inline std::array<double, 6> rotated(double x, double y, double degrees, double step_i, double step_j) {
  const double a = degrees * std::numbers::pi / 180, c = std::cos(a), s = std::sin(a);
  return {x, step_i * c, step_j * s, y, step_i * s, -step_j * c};
}

/// The grid filled with the samples of a function of the domain.
inline GridFile of_terrain(GridFile file, std::function<double(double, double)> terrain) {
  const Frame frame = Frame::from_geotransform(file.geotransform, "test");
  file.at = [frame, terrain = std::move(terrain)](int i, int j) {
    const Point p = frame.to_domain(i, j);
    return terrain(p.x, p.y);
  };
  return file;
}

/// Hills of 40 m with detail down to a metre.
inline double rough_terrain(double x, double y) {
  return 40 * std::sin(x / 170) * std::cos(y / 130) + 5 * std::sin(x / 21 + y / 37) + std::sin(x * 1.7 + y);
}

/// Literal heights, rows divided by '/': "0 1 0 / 1 x 1 / 0 1 0"; x is a hole.
inline GridFile heights(const std::string& text, GridFile file = {}) {
  auto rows = std::make_shared<std::vector<std::vector<double>>>(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (word == "/")
      rows->emplace_back();
    else
      rows->back().push_back(word == "x" ? kHole : std::stod(word));
  }
  file.width = int(rows->front().size()), file.height = int(rows->size());
  file.at = [rows](int i, int j) { return rows->at(size_t(j)).at(size_t(i)); };
  return file;
}

/// A temporary directory with grids and databases in it, gone with the object.
class GridFolder {
 public:
  GridFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "grids-XXXXXX").string();
    if (!mkdtemp(name.data())) std::abort();
    folder_ = name;
    GDALAllRegister();
  }
  ~GridFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  GridFolder(const GridFolder&) = delete;
  GridFolder& operator=(const GridFolder&) = delete;

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  /// Writes the grid as `name`.tif and returns its path.
  std::string write(const GridFile& file, const std::string& name) const {
    const std::string to = path(name + ".tif");
    GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        to.c_str(), file.width, file.height, 1, file.type, nullptr));
    if (!dataset) throw Error(to, "GDAL cannot make it");
    auto geotransform = file.geotransform;
    dataset->SetGeoTransform(geotransform.data());
    if (!file.pixel_is_area) dataset->SetMetadataItem("AREA_OR_POINT", "Point");
    GDALRasterBand& band = *dataset->GetRasterBand(1);
    if (file.nodata) band.SetNoDataValue(*file.nodata);
    std::vector<double> row(size_t(file.width));
    for (int j = 0; j < file.height; ++j) {
      for (int i = 0; i < file.width; ++i) {
        const double h = file.at(i, j);
        row[size_t(i)] = std::isnan(h) && file.nodata ? *file.nodata : h;
      }
      EXPECT_EQ(
          band.RasterIO(GF_Write, 0, j, file.width, 1, row.data(), file.width, 1, GDT_Float64, 0, 0, {}),
          CE_None);
    }
    return to;
  }

  RasterSource source(const GridFile& file, const std::string& name) const {
    return RasterSource::open(write(file, name), {.accuracy = file.accuracy}, "");
  }

  /// The database `name` of this folder, made if it is not there.
  Database database(const std::string& name = "grids.patchwork") const {
    return Database::open_or_create(path(name), "");
  }

  /// Imports the grid under `name`; throws what the import throws.
  ImportReport add(Database& db, const GridFile& file, const std::string& name,
                   ImportOptions options = {}) const {
    options.name = name;
    return db.import(source(file, name), options);
  }

 private:
  std::filesystem::path folder_;
};

/// What `act` is refused with; empty where it is not.
inline std::string refusal_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

}  // namespace patchwork
