// Bringing a file into the database's CRS, and joining tiles.
#include <cmath>
#include <memory>

#include "db/raster.h"
#include "tests/db/raster_files.h"

namespace patchwork {
namespace {

double hills(double x, double y) {
  return 300 + 80 * std::sin(x / 9.0) * std::cos(y / 7.0) + 25 * std::sin(x * y / 90);
}

RasterFile geographic(int width = 60, int height = 50) {
  return {.width = width,
          .height = height,
          .geotransform = {-122.5, 0.001, 0, 47.6, 0, -0.001},
          .crs = "EPSG:4326",
          .at = hills};
}

// The bilinear surface of row-major samples, one whole cell at a time: the reference, written without the
// library.
double bilinear(const std::vector<double>& s, int width, int height, double u, double v) {
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  if (i < 0 || j < 0 || i + 1 >= width || j + 1 >= height) return kNoData;
  const auto at = [&](int a, int b) { return s[static_cast<std::size_t>(b * width + a)]; };
  const double a = u - i, b = v - j;
  return at(i, j) * (1 - a) * (1 - b) + at(i + 1, j) * a * (1 - b) + at(i, j + 1) * (1 - a) * b +
         at(i + 1, j + 1) * a * b;
}

std::unique_ptr<OGRCoordinateTransformation> between(const char* from, const std::string& to) {
  OGRSpatialReference a, b;
  EXPECT_EQ(a.SetFromUserInput(from), OGRERR_NONE);
  EXPECT_EQ(b.SetFromUserInput(to.c_str()), OGRERR_NONE);
  a.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  b.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return std::unique_ptr<OGRCoordinateTransformation>(OGRCreateCoordinateTransformation(&a, &b));
}

bool names(const RasterSource& source, const char* crs) {
  OGRSpatialReference a, b;
  return a.importFromWkt(source.crs().c_str()) == OGRERR_NONE && b.SetFromUserInput(crs) == OGRERR_NONE &&
         a.IsSame(&b);
}

TEST_F(RasterTest, AProjectedFileInMetresKeepsItsCrsAndItsSamples) {
  const auto source = open(make({}), {.accuracy = 2});
  EXPECT_TRUE(names(source, "EPSG:26710"));
  EXPECT_FALSE(names(source, "EPSG:26711"));
  EXPECT_EQ(source.accuracy(), 2);
  EXPECT_EQ(joined_warnings(source), "");
  const auto again = open(make({}), {.accuracy = 2}, source.crs());
  EXPECT_EQ(again.crs(), source.crs()) << "WKT2 read back is the same text";
  EXPECT_EQ(joined_warnings(again), "") << "no warp";
}

TEST_F(RasterTest, AFileInDegreesGoesToTheZoneOfItsCentre) {
  const auto zone = [&](double lon, double lat, const char* expected, const char* crs = "EPSG:4326") {
    auto file = geographic(8, 8);
    file.crs = crs;
    file.geotransform = {lon - 0.004, 0.001, 0, lat + 0.004, 0, -0.001};
    const auto source = open(make(file));
    EXPECT_TRUE(names(source, expected)) << lon << " " << lat;
    EXPECT_SAYS(joined_warnings(source),
                std::string("is not a plane of metres: the database takes that of its centre, ") + expected);
    EXPECT_SAYS(joined_warnings(source), "added to its accuracy");
  };
  zone(-122.4, 47.5, "EPSG:32610");
  zone(-122.4, 47.5, "EPSG:32610", "EPSG:4269");
  zone(151.2, -33.9, "EPSG:32756");
  zone(-179.9, 10, "EPSG:32601");
  zone(179.9, 10, "EPSG:32660");
  zone(180.1, 10, "EPSG:32601");
  zone(20, 84.5, "EPSG:5041");
  zone(20, -80.5, "EPSG:5042");
}

TEST_F(RasterTest, AProjectedFileInFeetGoesToTheZoneOfItsCentre) {
  const auto source = open(make(
      {.width = 20, .height = 20, .geotransform = {1250000, 30, 0, 230000, 0, -30}, .crs = "EPSG:2926"}));
  EXPECT_TRUE(names(source, "EPSG:32610"));
  EXPECT_NEAR(source.frame().step_i(), 30 * 1200.0 / 3937, 0.01);
}

TEST_F(RasterTest, AFileWithoutCrsIsTakenToBeInTheDatabases) {
  RasterFile file;
  file.crs = "";
  const auto source = open(make(file), {.accuracy = 0}, "EPSG:26710");
  EXPECT_SAYS(joined_warnings(source), "names no CRS: taken to be in the database's");
  EXPECT_TRUE(names(source, "EPSG:26710"));
  EXPECT_SAYS(joined_warnings(open(make(file))), "names no CRS: its coordinates are taken as metres");
}

TEST_F(RasterTest, TheCrsOptionOverridesTheFiles) {
  EXPECT_TRUE(names(open(make({}), {.crs = "EPSG:32611"}), "EPSG:32611"));
  EXPECT_EQ(joined_warnings(open(make({}), {.crs = "EPSG:32611", .accuracy = 0}, "EPSG:32611")), "");
}

TEST_F(RasterTest, TheVerticalPartOfACompoundCrsIsLeftOutAndSaid) {
  const auto source = open(make({.crs = "EPSG:26710+5703"}), {.accuracy = 0}, "EPSG:26710");
  EXPECT_EQ(joined_warnings(source), "the vertical part of its CRS is left out\n");
  EXPECT_TRUE(names(source, "EPSG:26710"));
}

TEST_F(RasterTest, CrsThatCannotBeTransformedAreRefused) {
  EXPECT_SAYS(refusal(make({}), {.crs = "LOCAL_CS[\"a\",UNIT[\"metre\",1]]"}, "EPSG:26710"),
              "cannot be transformed");
  EXPECT_SAYS(refusal(make({}), {.crs = "EPSG:5703"}), "has no horizontal plane");
  EXPECT_SAYS(refusal(make({.geotransform = {500, 1, 0, 300, 0, -1}, .crs = "EPSG:4326"})),
              "its centre has no longitude and latitude");
  auto world = geographic(36, 18);
  world.geotransform = {-180, 10, 0, 90, 0, -10};
  for (const char* crs : {"EPSG:32610", "EPSG:5041", "EPSG:2154"})
    EXPECT_SAYS(refusal(make(world), {}, crs), std::string("reaches beyond what ") + crs + " can show");
}

// Brute force over a dense cloud of points, some in every cell of either grid.
TEST_F(RasterTest, TheCostOfAWarpBoundsTheDifferenceOfTheSurfaces) {
  std::mt19937 random(seed());
  auto file = geographic();
  const auto original = samples(open(make(file), {.crs = "EPSG:32610"}));
  const auto source = open(make(file), {.accuracy = 0});
  ASSERT_GT(source.accuracy(), 0);
  const auto warped = samples(source, 7);
  const auto inverse = between("EPSG:32610", "EPSG:4326");
  double worst = 0;
  for (int k = 0; k < 200000; ++k) {
    std::uniform_real_distribution<double> i(0, source.width() - 1), j(0, source.height() - 1);
    const double u = i(random), v = j(random);
    Point p = source.frame().to_domain(u, v);
    ASSERT_TRUE(inverse->Transform(1, &p.x, &p.y));
    const double a =
        bilinear(original, file.width, file.height, (p.x + 122.5) / 0.001 - 0.5, (47.6 - p.y) / 0.001 - 0.5);
    const double d = std::abs(a - bilinear(warped, source.width(), source.height(), u, v));
    if (d > worst) worst = d;
  }
  EXPECT_LE(worst, source.accuracy() * 1.001);
  EXPECT_GT(worst, source.accuracy() * 0.7) << "the bound is not idle";
  char said[40];
  std::snprintf(said, sizeof said, "%.2f m added to its accuracy", std::ceil(source.accuracy() * 100) / 100);
  EXPECT_SAYS(joined_warnings(source), said);
  EXPECT_FALSE(source.integer_samples());
}

TEST_F(RasterTest, AWarpedGridKeepsOrientationStepsAndHandednessAndHoldsTheWholeBorder) {
  for (const double mirror : {-1.0, 1.0}) {
    RasterFile file{.width = 90,
                    .height = 70,
                    .geotransform = {500000, 8, 6 * -mirror, 5000000, 6, 8 * mirror},
                    .at = hills};
    const auto here = open(make(file));
    const auto there = open(make(file), {}, "EPSG:32611");
    const auto& a = here.frame();
    const auto& b = there.frame();
    EXPECT_NEAR(b.step_i(), a.step_i(), 0.1);
    EXPECT_NEAR(b.step_j(), a.step_j(), 0.1);
    EXPECT_GT((a.inverse()[0] * a.inverse()[3] - a.inverse()[1] * a.inverse()[2]) *
                  (b.inverse()[0] * b.inverse()[3] - b.inverse()[1] * b.inverse()[2]),
              0);
    const auto forward = between("EPSG:26710", "EPSG:32611");
    for (int k = 0; k <= 500; ++k)
      for (const auto& [u, v] :
           {std::pair{k / 500.0, 0.0}, {k / 500.0, 1.0}, {0.0, k / 500.0}, {1.0, k / 500.0}}) {
        Point p = a.to_domain(u * 90 - 0.5, v * 70 - 0.5);
        ASSERT_TRUE(forward->Transform(1, &p.x, &p.y));
        const Point q = b.to_lattice(p.x, p.y);
        EXPECT_TRUE(q.x > -0.501 && q.y > -0.501 && q.x < there.width() - 0.499 &&
                    q.y < there.height() - 0.499);
      }
    EXPECT_LT(there.width(), 90 + 8);
    EXPECT_LT(there.height(), 70 + 8);
  }
}

TEST_F(RasterTest, NoNodataLeaksThroughAWarp) {
  auto file = geographic();
  file.nodata = -9999;
  file.at = [](int i, int j) {
    if (i % 11 == 3 && j % 7 == 2) return -9999.0;
    if (i % 13 == 5 && j % 9 == 4) return -32768.0;
    return i == 20 && j == 20 ? double(INFINITY) : hills(i, j);
  };
  const auto range = [&](const RasterOptions& options) {
    double lowest = INFINITY, highest = -INFINITY;
    long holes = 0;
    for (const double h : samples(open(make(file), options))) {
      holes += std::isnan(h);
      lowest = std::fmin(lowest, h);
      highest = std::fmax(highest, h);
    }
    EXPECT_GT(holes, 60);
    return std::pair{lowest, highest};
  };
  const auto [lowest, highest] = range({.nodata = {-32768}});
  EXPECT_GE(lowest, 300 - 80 - 25 - 40);  // half a cell of linear extrapolation at the border
  EXPECT_LE(highest, 300 + 80 + 25 + 40);
  EXPECT_LT(range({}).first, -1000) << "an undeclared marker does leak";
}

TEST_F(RasterTest, BandScaleAndUnitApplyAfterTheWarp) {
  auto file = geographic();
  const double plain = open(make(file), {.accuracy = 0}).accuracy();
  const auto raw = samples(open(make(file), {.accuracy = 0}));
  file.scale = 0.5;
  file.unit = "ft";
  const auto scaled = open(make(file), {.accuracy = 0});
  EXPECT_DOUBLE_EQ(scaled.scale(), 0.1524);
  EXPECT_NEAR(scaled.accuracy(), plain * 0.1524, 1e-9);
  const auto same_raw = samples(scaled);
  for (std::size_t k = 0; k < raw.size(); ++k)
    EXPECT_TRUE(same_raw[k] == raw[k] || (std::isnan(same_raw[k]) && std::isnan(raw[k]))) << k;
}

TEST_F(RasterTest, AWarpThatMovesNothingKeepsEverySample) {
  auto file = RasterFile{.width = 40, .height = 30, .crs = "EPSG:32610", .at = hills};
  const auto source =
      open(make(file), {.accuracy = 0}, "+proj=utm +zone=10 +datum=WGS84 +x_0=600000 +units=m");
  ASSERT_EQ(source.width(), 40);
  ASSERT_EQ(source.height(), 30);
  EXPECT_LT(source.accuracy(), 0.5);
  EXPECT_EQ(samples(source).size(), 1200u);
  for (const double h : samples(source)) EXPECT_FALSE(std::isnan(h));
}

TEST_F(RasterTest, PointsThatAreTooFewToWarpAreRefused) {
  auto file = geographic(2, 2);
  file.point = true;
  file.geotransform = {-122.5, 1, 0, 60, 0, -1};
  EXPECT_SAYS(refusal(make(file), {}, "EPSG:32612"), "is too small to be warped");
}

TEST_F(RasterTest, AWarpTooLargeForMemoryUsesTheTemporaryDirectoryOrSaysSo) {
  auto file = geographic(70000, 500);  // 280 MB as doubles
  file.geotransform = {-122.5, 1e-6, 0, 47.6, 0, -1e-6};
  file.type = GDT_Byte;
  file.at = [](int, int) { return 42; };
  const std::string path = make(file);
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  setenv("TMPDIR", in_directory("absent").c_str(), 1);
  EXPECT_SAYS(refusal(path), "there is no room for 267 MB of temporary samples; set TMPDIR");
  before ? setenv("TMPDIR", kept.c_str(), 1) : unsetenv("TMPDIR");
  const auto source = open(path, {.accuracy = 0});
  EXPECT_NEAR(source.accuracy(), 0, 1e-9);
  std::vector<double> row(static_cast<std::size_t>(source.width()));
  source.read_rows(source.height() / 2, 1, row);
  EXPECT_NEAR(row[row.size() / 2], 42, 1e-9);
}

class JoinTest : public RasterTest {
 protected:
  // A tile of the surface `hills` on one rotated lattice; (i, j) is its first cell.
  RasterFile tile(int i0, int j0, int width = 12, int height = 9) const {
    return {.width = width,
            .height = height,
            .type = GDT_Float64,
            .geotransform = {1000 + 8.0 * i0 + 6.0 * j0, 8, 6, 5000 + 6.0 * i0 - 8.0 * j0, 6, -8},
            .nodata = -1,
            .at = [=](int i, int j) { return hills(i0 + i, j0 + j); }};
  }
  static std::string join_refusal(const std::vector<std::string>& paths, const RasterOptions& options = {}) {
    return refusal([&] { RasterSource::open_joined(paths, options, ""); });
  }
};

TEST_F(JoinTest, TilesReadAsTheGridThatTheyWereCutFrom) {
  std::vector<std::string> paths;
  for (const auto& [i, j] : {std::pair{12, 9}, {0, 0}, {12, 0}, {0, 9}})
    paths.push_back(make(tile(i, j), "t" + std::to_string(i) + "_" + std::to_string(j) + ".tif"));
  const auto joined = RasterSource::open_joined(paths, {.accuracy = 1}, "");
  const auto whole = open(make(tile(0, 0, 24, 18), "whole.tif"), {.accuracy = 1});
  EXPECT_EQ(joined.width(), 24);
  EXPECT_EQ(joined.height(), 18);
  EXPECT_EQ(joined.frame().numbers(), whole.frame().numbers());
  EXPECT_EQ(joined.crs(), whole.crs());
  EXPECT_EQ(joined_warnings(joined), "");
  for (const int rows : {1, 4, 18}) EXPECT_EQ(samples(joined, rows), samples(whole));
  std::swap(paths[0], paths[3]);
  EXPECT_EQ(samples(RasterSource::open_joined(paths, {}, "")), samples(whole)) << "in any order";
}

TEST_F(JoinTest, GapsHaveNoDataAndAnEarlierTileSpeaksWhereTilesOverlap) {
  auto late = tile(10, 4);
  late.at = [](int, int) { return 7; };
  auto early = tile(0, 0);
  early.at = [](int i, int j) { return i == 11 && j == 8 ? -1.0 : 5.0; };
  const auto joined = RasterSource::open_joined({make(early, "a.tif"), make(late, "b.tif")}, {}, "");
  const auto s = samples(joined, 5);
  const auto at = [&](int i, int j) { return s[static_cast<std::size_t>(j * joined.width() + i)]; };
  EXPECT_EQ(joined.width(), 22);
  EXPECT_EQ(joined.height(), 13);
  EXPECT_EQ(at(10, 5), 5);
  EXPECT_EQ(at(11, 8), 7) << "a hole lets the later tile through";
  EXPECT_EQ(at(12, 5), 7);
  EXPECT_TRUE(std::isnan(at(12, 3)));
  EXPECT_TRUE(std::isnan(at(9, 9)));
  EXPECT_SAYS(joined_warnings(joined),
              "its tiles differ by up to 2 m where they overlap: the earlier file is taken");
}

TEST_F(JoinTest, FilesThatAreNoTilesOfOneGridAreRefusedByName) {
  const std::string first = make(tile(0, 0), "first.tif");
  const auto with = [&](const std::function<void(RasterFile&)>& change) {
    RasterFile file = tile(12, 0);
    change(file);
    const std::string said = join_refusal({first, make(file, "second.tif")});
    EXPECT_TRUE(said.empty() || says(said, "second.tif: ")) << said;
    return said;
  };
  EXPECT_EQ(with([](RasterFile&) {}), "");
  EXPECT_EQ(with([](RasterFile& f) { f.geotransform[0] += 0.005; }), "") << "snapped";
  EXPECT_SAYS(with([](RasterFile& f) { f.geotransform[0] += 0.02; }),
              "does not lie a whole number of cells from");
  EXPECT_SAYS(with([](RasterFile& f) { f.geotransform[0] = 1e12; }), "");
  EXPECT_SAYS(with([](RasterFile& f) { f.geotransform = {1000, 8 * 1e12, 0, 5000, 0, -1}; }),
              "its steps or rotation differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.geotransform = {1000, 8, 6, 5000, 6.0001, -8}; }),
              "its steps or rotation");
  EXPECT_SAYS(with([](RasterFile& f) { f.geotransform[0] += 8e10, f.geotransform[3] += 6e10; }),
              "lies too far from");
  EXPECT_SAYS(with([](RasterFile& f) { f.type = GDT_Float32; }), "its sample type differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.unit = "ft"; }), "its unit, scale or offset differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.offset = 4; }), "its unit, scale or offset differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.point = true; }), "its registration (area or point) differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.crs = "EPSG:26711"; }), "its CRS differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.crs = ""; }), "its CRS differs");
  EXPECT_SAYS(with([](RasterFile& f) { f.nodata = -2; }), "its nodata value differs");
  EXPECT_SAYS(join_refusal({}), "no files given");
  EXPECT_SAYS(join_refusal({first, "absent.tif"}), "absent.tif: there is no such file");
}

TEST_F(JoinTest, ThinTilesMakeAGridTogether) {
  EXPECT_SAYS(join_refusal({make(tile(0, 0, 12, 1), "a.tif")}), "12 x 1 samples");
  EXPECT_EQ(
      RasterSource::open_joined({make(tile(0, 0, 12, 1), "a.tif"), make(tile(0, 1, 12, 1), "b.tif")}, {}, "")
          .height(),
      2);
}

TEST_F(JoinTest, JoinedTilesAreWarpedAsOneGrid) {
  auto west = geographic(30, 50), east = geographic(30, 50);
  east.geotransform[0] += 0.030;
  east.at = [](int i, int j) { return hills(30 + i, j); };
  const auto joined =
      RasterSource::open_joined({make(west, "w.tif"), make(east, "e.tif")}, {.accuracy = 0}, "");
  const auto whole = open(make(geographic(), "whole.tif"), {.accuracy = 0});
  EXPECT_EQ(joined.accuracy(), whole.accuracy());
  const auto a = samples(joined), b = samples(whole);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    EXPECT_TRUE(a[k] == b[k] || (std::isnan(a[k]) && std::isnan(b[k])));
}

}  // namespace
}  // namespace patchwork
