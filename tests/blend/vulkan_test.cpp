// CpuGpuParity (hard cases): the shaders' surface is the CPU's, wherever a surface is hard to get right.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/blend/vulkan_scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

class CpuGpuParity : public VulkanTest {
 protected:
  static constexpr int kSide = 150;

  // Both engines on one extraction with every blend; prints how far apart they were.
  static ParityFigures compare(const Database& db, std::span<const PatchId> patches,
                               const RasterFrame& raster, const std::string& what, int side = kSide) {
    ParityFigures all;
    for (const BlendOptions& options : all_blends()) {
      const Answers cpu = at_pixels(Blend(db, patches, options), raster, side);
      const Answers gpu = at_pixels(VulkanBlend(test_device(), db, patches, options), raster, side);
      all.add(expect_parity(cpu, gpu, what + " " + name_of(options)));
    }
    EXPECT_GT(all.answered, 0u) << what;
    report_case("CpuGpuParity", what, all.points, all.worst, 1, "of 1 mm + 1e-6 of the height");
    return all;
  }
  static void compare(const Land& scene, std::initializer_list<double> errors, double degrees,
                      const std::string& what) {
    for (const double error : errors)
      compare(scene.db(), extract(scene.db(), {.error = error}).patches,
              turned_raster(scene.db().extent(), kSide, degrees), what + " error " + std::to_string(error));
  }
};

TEST_F(CpuGpuParity, RotatedMirroredAndOverlappingGridsUnderUniformCuts) {
  const Land scene(surveys());
  compare(scene, {0.0, 1.0, 5.0, 100.0}, 11, "surveys");
}

TEST_F(CpuGpuParity, UnderViewCuts) {
  const Land scene(surveys());
  std::mt19937_64 random(test_seed(1));
  const Extent e = scene.db().extent();
  std::uniform_real_distribution<double> x(e.xmin, e.xmax), y(e.ymin, e.ymax);
  for (const double pixel_error : {1.0, 4.0, 16.0}) {
    ViewCut view{
        .eye = {x(random), y(random), 500}, .look = {x(random), y(random), 300}, .pixel_error = pixel_error};
    const Extraction cut = extract(scene.db(), over_terrain_of(scene.db(), view));
    compare(scene.db(), cut.patches, turned_raster(e, kSide, -20), "view " + std::to_string(pixel_error));
  }
}

TEST_F(CpuGpuParity, TheBoundOfARasterHolds) {
  const Land scene(surveys());
  const RasterFrame raster = turned_raster(scene.db().extent(), kSide, 3);
  for (const double error : {0.0, 5.0, 100.0})
    for (const BlendOptions& options : all_blends()) {
      const Extraction x = extract(scene.db(), {.error = error});
      const Answers a = at_pixels(VulkanBlend(test_device(), scene.db(), x.patches, options), raster, kSide);
      EXPECT_LT(std::count(a.source.begin(), a.source.end(), 0), kSide * kSide * 3 / 4);
      for (int k = 0; k < kSide * kSide; ++k) {
        if (a.source[size_t(k)] == 0) continue;
        const double c = k % kSide, r = k / kSide, h = a.height[size_t(k)];
        const double truth =
            hills(raster.x0 + raster.xc * c + raster.xr * r, raster.y0 + raster.yc * c + raster.yr * r);
        ASSERT_LE(std::abs(h - truth), a.bound[size_t(k)]) << name_of(options);
      }
    }
}

TEST_F(CpuGpuParity, FarOrigin) {
  for (const Point offset : {Point{500000, 5000000}, Point{1e7, -1e7}}) {
    std::vector<GridFile> far = surveys();
    for (GridFile& g : far) g.geotransform[0] += offset.x, g.geotransform[3] += offset.y;
    compare(Land(far), {0.0, 3.0}, 17, "far origin");
  }
  // 1e-5 degrees of longitude and latitude.
  GridFile degrees{.width = 120, .height = 100, .geotransform = {11.5, 1e-5, 0, 47.25, 0, -1e-5}};
  degrees.at = [](int i, int j) { return 800 + 3 * std::sin(i / 9.0) + 2 * std::cos(j / 5.0); };
  compare(Land({degrees}), {0.0}, 17, "degrees");
}

// What the shaders do not do: window coordinates from absolute positions in float32.
TEST_F(CpuGpuParity, AbsoluteCoordinatesInFloatWouldBreakTheLimit) {
  std::vector<GridFile> far = surveys();
  for (GridFile& g : far) g.geotransform[0] += 500000, g.geotransform[3] += 5000000;
  const Land scene(far);
  const Extraction x = extract(scene.db(), {.error = 0});
  std::mt19937_64 random(test_seed(2));
  Points exact = random_points(scene.db().extent(), 2000, random), rounded;
  for (std::size_t k = 0; k < exact.size(); ++k)
    rounded.add(double(float(exact.x[k])), double(float(exact.y[k])));
  const Answers a = evaluate(scene.db(), x.patches, exact), b = evaluate(scene.db(), x.patches, rounded);
  std::size_t beyond = 0;
  for (std::size_t k = 0; k < exact.size(); ++k)
    beyond += std::abs(a.height[k] - b.height[k]) > parity(a.height[k]);
  EXPECT_GT(beyond, exact.size() / 2);
}

TEST_F(CpuGpuParity, RatioOfScales) {
  GridFile globe{.width = 60, .height = 60, .geotransform = {0, 1000, 0, 60000, 0, -1000}, .accuracy = 50};
  globe.at = [](int i, int j) { return 1000.0 + 8 * ((3 * i + 5 * j) % 7); };
  GridFile drone{.width = 300, .height = 300, .geotransform = rotated(30210, 30570, 31, 0.01, 0.01)};
  drone.accuracy = 0.02, drone.at = [](int i, int j) { return 1020 + 0.125 * ((i / 8 + j / 8) % 2); };
  const Land scene({globe, drone});
  const Extraction x = extract(scene.db(), {.error = 0});
  // Rasters of 420 m and of 1 cm over both, and one whose pixels stride over the whole drone grid.
  compare(scene.db(), x.patches, turned_raster(scene.db().extent(), kSide, 5), "globe");
  const Extent near = scene.db().grids()[1].info.frame.bounds({-60, -60, 360, 360});
  compare(scene.db(), x.patches, turned_raster(near, kSide, 40), "drone");
  compare(scene.db(), x.patches, {30210 - 75 * 10.0, 10, 0, 30570 + 75 * 10.0, 0, -10}, "drone, strided");
}

TEST_F(CpuGpuParity, NodataEdges) {
  const std::function<bool(int, int)> patterns[] = {
      [](int i, int j) { return i == 47 && j == 31; },
      [](int i, int j) { return i % 9 == 4 && j % 7 == 3; },
      [](int i, int j) { return (i / 3 + j / 3) % 2 == 1; },
      [](int i, int j) { return i + j < 70; },
      [](int i, int) { return i % 4 == 0; },
      [](int i, int j) { return i < 60 || i > 61 || j < 40 || j > 41; }};
  for (const auto& hole : patterns) {
    GridFile ragged{
        .width = 115, .height = 87, .geotransform = {800, 8, 0, 1600, 0, -8}, .pixel_is_area = false};
    ragged.nodata = -9999, ragged.accuracy = 0.2;
    ragged.at = [&hole](int i, int j) {
      return hole(i, j) ? kHole : 100 + 5 * std::sin(i / 9.0) + (i * 7 + j * 3) % 5;
    };
    GridFile base{.width = 90, .height = 80, .geotransform = {700, 13, 0, 1700, 0, -13}, .accuracy = 3};
    base.at = [](int i, int j) { return 102 + (i + j) % 3; };
    const Land alone({ragged}), covered({base, ragged});
    compare(alone, {0.0, 5.0, 1000.0}, 7, "holes");
    compare(covered, {0.0, 5.0}, 7, "holes over a base");
    // Pixels on the samples and on the middles of cells: every edge of every hole is hit exactly.
    for (const double error : {0.0, 20.0})
      compare(alone.db(), extract(alone.db(), {.error = error}).patches, {804, 4, 0, 1596, 0, -4},
              "holes, on samples");
  }
}

// Rasters whose rows and columns lie on the rim of all data, and a hair inside and outside of it.
TEST_F(CpuGpuParity, RimWeights) {
  for (const bool area : {true, false}) {
    GridFile west{.width = 40, .height = 40, .geotransform = {0, 10, 0, 400, 0, -10}, .pixel_is_area = area};
    GridFile east = west;
    east.geotransform[0] = 360;
    west.at = [](int, int) { return 10.0; }, east.at = [](int, int) { return 20.0; };
    const Land scene({west, east});
    const Extraction x = extract(scene.db(), {.error = 0});
    const double rim = area ? 0 : 5;
    for (const double inside : {0.0, 1e-14, 1e-11, 1e-8, 1e-5, 1e-3, -1e-12, -1e-7, -1e-4})
      compare(scene.db(), x.patches,
              {rim + inside, (400 - 2 * rim - 2 * inside) / 80, 0, rim + inside, 0,
               (400 - 2 * rim - 2 * inside) / 80},
              "rim " + std::to_string(inside), 160);
  }
}

TEST_F(CpuGpuParity, PartitionOfUnity) {
  std::vector<GridFile> grids = surveys();
  for (GridFile& g : grids) g.at = [](int, int) { return 1234.5; }, g.accuracy = 0.1;
  const Land constant(grids);
  const RasterFrame raster = turned_raster(constant.db().extent(), kSide, 30);
  const Extraction x = extract(constant.db(), {.error = 0.2});
  for (const BlendOptions& options : all_blends()) {
    const Answers a = at_pixels(VulkanBlend(test_device(), constant.db(), x.patches, options), raster, kSide);
    EXPECT_LT(std::count(a.source.begin(), a.source.end(), 0), kSide * kSide * 3 / 4);
    for (std::size_t k = 0; k < a.height.size(); ++k)
      if (a.source[k] != 0) {
        ASSERT_EQ(a.height[k], 1234.5) << name_of(options);
      }
  }
  const auto plane = [](double px, double py) { return 100 + 0.25 * px - 0.125 * py; };
  grids = surveys();
  for (GridFile& g : grids) g = of_terrain(g, plane), g.accuracy = 0.5;
  compare(Land(grids), {0.0, 0.6}, 12, "plane");
}

TEST_F(CpuGpuParity, SplineStencil) {
  GridFile spikes{.width = 131, .height = 100, .geotransform = {0, 8, 0, 800, 0, -8}};
  spikes.at = [](int i, int j) {
    return (i * 37 + j * 101) % 23 == 0 ? 5000.0 : double((i * 5 + j * 3) % 11);
  };
  compare(Land({spikes}), {0.0, 500.0}, 9, "spikes");
  // As steep as float32 is trusted with, at smoothness 0 and above.
  for (const double height : {3990.0, 1490.0}) {
    spikes.at = [height](int i, int j) {
      return (i * 37 + j * 101) % 23 == 0 ? height : double((i * 5 + j * 3) % 11);
    };
    compare(Land({spikes}), {0.0, 500.0}, 9, "spikes of " + std::to_string(height));
  }
  GridFile smallest{.width = 2, .height = 2, .geotransform = {0, 10, 0, 20, 0, -10}};
  smallest.at = [](int i, int j) { return 3.0 * i + 5 * j; };
  compare(Land({smallest}), {0.0}, 9, "two samples a side");
}

TEST_F(CpuGpuParity, DegenerateGrids) {
  GridFile sheet{.width = 200, .height = 3, .geotransform = {0, -7, 0, 100, 0, 0.5}};
  sheet.at = [](int i, int j) { return -50 + 0.1 * i + j; };
  compare(Land({sheet}), {0.0, 1.0}, 2, "mirrored sheet");
  GridFile high{.width = 60, .height = 60, .geotransform = {0, 90, 0, 5400, 0, -90}};
  high.at = [](int i, int j) { return i < 30 ? 8848.8 - j : -420.3 + j; };
  compare(Land({high}), {0.0, 50.0}, 2, "cliff of nine kilometres");
}

// Explicit points are evaluated in double: rims, corners and far origins at once.
TEST_F(CpuGpuParity, PointsAreTheCpusToAMicrometre) {
  std::vector<GridFile> far = surveys();
  for (GridFile& g : far) g.geotransform[0] += 500000, g.geotransform[3] += 5000000;
  far[1].at = [whole = far[1].at](int i, int j) {
    return i > 30 && i < 50 && j > 20 && j < 40 ? kHole : whole(i, j);
  };
  const Land scene(far);
  std::mt19937_64 random(test_seed(3));
  Points points = random_points(scene.db().extent(), 20000, random);
  points.add(NAN, 0), points.add(INFINITY, 5e6), points.add(0, 0);
  for (const double error : {0.0, 5.0})
    for (const BlendOptions& options : all_blends()) {
      const Extraction x = extract(scene.db(), {.error = error});
      const Answers a = at_points(Blend(scene.db(), x.patches, options), points);
      const Answers b = at_points(VulkanBlend(test_device(), scene.db(), x.patches, options), points);
      EXPECT_EQ(a.source, b.source) << name_of(options);
      for (std::size_t k = 0; k < points.size(); ++k)
        if (a.source[k] != 0) {
          ASSERT_NEAR(a.height[k], b.height[k], 1e-6) << name_of(options);
          ASSERT_NEAR(a.bound[k], b.bound[k], 1e-6) << name_of(options);
        }
    }
}

TEST_F(CpuGpuParity, StrictWithholdsWhereTheErrorIsNotAvailable) {
  const Land scene(surveys());
  const RasterFrame raster = turned_raster(scene.db().extent(), kSide, 8);
  for (BlendOptions options : all_blends()) {
    options.strict = true, options.error = 2;
    const Extraction x = extract(scene.db(), {.error = 2});
    const Answers cpu = at_pixels(Blend(scene.db(), x.patches, options), raster, kSide);
    const Answers gpu = at_pixels(VulkanBlend(test_device(), scene.db(), x.patches, options), raster, kSide);
    std::size_t other = 0;
    for (std::size_t k = 0; k < cpu.source.size(); ++k)
      if ((cpu.source[k] == 0) != (gpu.source[k] == 0)) {
        ++other;
        const double bound = cpu.source[k] != 0 ? cpu.bound[k] : gpu.bound[k] - parity(gpu.height[k]);
        EXPECT_NEAR(bound, 2, 1e-5) << "only rounding may decide otherwise";
      }
    EXPECT_LE(other, 2u) << name_of(options);
    EXPECT_GT(std::count(cpu.source.begin(), cpu.source.end(), 0), 100);
  }
}

}  // namespace
}  // namespace patchwork
