// Opening and reading one file: what is refused, what is masked, what heights its numbers mean.
#include "db/raster.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <span>

#include "tests/db/raster_files.h"

namespace patchwork {
namespace {

// Equal bit patterns up to the kind of NaN.
bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

TEST_F(RasterTest, ReadsWhatWasWrittenWhateverTheBandOfRows) {
  std::mt19937 random(seed());
  for (const GDALDataType type : {GDT_Byte, GDT_UInt16, GDT_Int16, GDT_UInt32, GDT_Int32, GDT_UInt64,
                                  GDT_Int64, GDT_Float32, GDT_Float64}) {
    std::vector<double> expected;
    RasterFile file{.width = 37, .height = 23, .type = type};
    file.at = [&](int, int) { return expected.emplace_back(double(random() % 200)); };
    const auto source = open(make(file));
    for (const int rows : {1, 5, 23}) EXPECT_TRUE(same(samples(source, rows), expected)) << type;
    EXPECT_EQ(source.sample_bytes(), GDALGetDataTypeSizeBytes(type));
    EXPECT_EQ(source.integer_samples(), type != GDT_Float32 && type != GDT_Float64);
    expected[7] += 1;
    EXPECT_FALSE(same(samples(source), expected)) << "the comparison can fail";
  }
}

TEST_F(RasterTest, FloatRowsEqualDoubleRowsWhereFloatIsExact) {
  for (const GDALDataType type : {GDT_Byte, GDT_UInt16, GDT_Int16, GDT_Float32, GDT_Int32, GDT_Float64}) {
    const auto source = open(make({.type = type, .nodata = 101}));
    const bool small = type != GDT_Int32 && type != GDT_Float64;
    ASSERT_EQ(source.float_is_exact(), small);
    if (!small) continue;
    std::vector<float> floats(12);
    source.read_rows(0, 3, std::span<float>(floats));
    EXPECT_TRUE(same(samples(source), {floats.begin(), floats.end()}));
    EXPECT_TRUE(std::isnan(floats[5]));
  }
}

TEST_F(RasterTest, RefusesWhatIsNoHeightGrid) {
  EXPECT_SAYS(refusal(in_directory("absent.tif")), "there is no such file");
  std::ofstream(in_directory("text.tif")) << "not a picture at all\n";
  EXPECT_SAYS(refusal(in_directory("text.tif")), "is not a raster that GDAL can read (GDAL: ");
  EXPECT_SAYS(refusal(make({.bands = 3})), "has 3 bands; choose the heights with --band");
  EXPECT_SAYS(refusal(make({}), {.band = 2}), "has no band 2; it has bands 1 to 1");
  EXPECT_SAYS(refusal(make({}), {.band = 0}), "has no band 0");
  EXPECT_SAYS(refusal(make({.width = 1, .height = 9})),
              "grid of 1 x 9 samples; a surface needs at least 2 x 2");
  EXPECT_SAYS(refusal(make({.width = 9, .height = 1})), "grid of 9 x 1 samples");
  EXPECT_SAYS(refusal(make({.type = GDT_CFloat32})), "holds samples of type CFloat32");
  EXPECT_SAYS(refusal(make({.geotransform = {0, 10, 5, 0, 0, -10}})), "sheared");
  EXPECT_SAYS(refusal(make({.geotransform = {0, 0, 0, 0, 0, -10}, .driver = "ENVI"}, "zero.img")),
              "step of zero");
  EXPECT_EQ(refusal(make({.width = 2, .height = 2})), "");
}

TEST_F(RasterTest, RefusesAContainerWithoutBandsAndNamesAGridInIt) {
  const std::string path = in_directory("two.gpkg");
  for (const char* table : {"RASTER_TABLE=first", "RASTER_TABLE=second"}) {
    const char* const options[] = {table, "APPEND_SUBDATASET=YES", nullptr};
    GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GPKG")->Create(
        path.c_str(), 256, 256, 1, GDT_Byte, const_cast<char**>(options)));
    double gt[6] = {0, 1, 0, 0, 0, -1};
    ASSERT_EQ(dataset->SetGeoTransform(gt), CE_None);
    ASSERT_EQ(dataset->GetRasterBand(1)->Fill(7), CE_None);
  }
  EXPECT_SAYS(refusal(path), "has no bands of its own; name one of the grids in it, such as GPKG:");
  EXPECT_SAYS(refusal("GPKG:" + path + ":second"), "has 3 bands") << "and an alpha band, which is no choice";
}

TEST_F(RasterTest, RefusesOptionsThatNoFileCanMeet) {
  const std::string path = make({});
  for (const double accuracy : {-1.0, double(NAN), double(INFINITY)})
    EXPECT_SAYS(refusal(path, {.accuracy = accuracy}), "accuracy must be a number of metres >= 0");
  EXPECT_SAYS(refusal(path, {.vertical_offset = NAN}), "--vertical-offset: must be a finite number");
  EXPECT_SAYS(refusal(path, {.unit = "furlong"}), "\"furlong\" is not a unit; use m, ft, us-ft or cm");
  EXPECT_SAYS(refusal(path, {.crs = "EPSG:nonsense"}), "--crs: \"EPSG:nonsense\" is not a CRS");
  EXPECT_SAYS(refusal(path, {}, "no such crs"), "database CRS: \"no such crs\" is not a CRS");
  EXPECT_SAYS(refusal(path, {}, "EPSG:4326"), "EPSG:4326 is not a projected CRS in metres");
  EXPECT_EQ(refusal(path, {.vertical_offset = -3, .accuracy = 0}), "");
}

TEST_F(RasterTest, PrintsNothing) {
  std::ofstream(in_directory("text.tif")) << "not a picture at all\n";
  testing::internal::CaptureStderr();
  refusal(in_directory("text.tif"));
  refusal(in_directory("absent.tif"));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  testing::internal::CaptureStderr();
  GDALDataset::Open(in_directory("absent.tif").c_str(), GDAL_OF_VERBOSE_ERROR);
  EXPECT_NE(testing::internal::GetCapturedStderr(), "") << "GDAL left alone does print";
}

TEST_F(RasterTest, ATruncatedTiffIsRefusedAndNeverReadAsZeros) {
  std::mt19937 random(1);
  for (const std::string compression : {"NONE", "DEFLATE", "LZW"})
    for (const std::string tiled : {"NO", "YES"})
      for (const auto nodata : {std::optional<double>(), std::optional<double>(0)}) {
        RasterFile file{.width = 300,
                        .height = 200,
                        .creation = {"COMPRESS=" + compression, "TILED=" + tiled},
                        .nodata = nodata};
        file.at = [&](int, int) { return 1 + double(random() % 100000); };
        const std::string path = make(file), whole = path + ".whole";
        const auto expected = samples(open(path));
        std::filesystem::copy_file(path, whole, std::filesystem::copy_options::overwrite_existing);
        // The last cuts may take the padding of edge tiles alone: then every sample must still be right.
        for (const double kept : {0.01, 0.4, 0.7, 0.95, 0.9999}) {
          std::filesystem::copy_file(whole, path, std::filesystem::copy_options::overwrite_existing);
          std::filesystem::resize_file(
              path, static_cast<std::uintmax_t>(kept * double(std::filesystem::file_size(path))));
          const std::string said = refusal(path);
          EXPECT_TRUE(says(said, "ends early or is damaged") ||
                      (kept > 0.9 && said.empty() && same(samples(open(path)), expected)))
              << compression << " tiled " << tiled << " cut to " << kept << ": " << said;
        }
      }
}

TEST_F(RasterTest, ATruncatedRawFileIsRefused) {
  for (const auto& [driver, name] : {std::pair{"ENVI", "raw.img"}, {"EHdr", "raw.bil"}}) {
    const std::string path = make({.width = 300, .height = 200, .driver = driver}, name);
    EXPECT_EQ(refusal(path), "");
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - 5);
    EXPECT_SAYS(refusal(path), "ends early") << driver;
  }
}

TEST_F(RasterTest, DamagedBytesOfACompressedFileAreRefused) {
  const std::string path = make({.width = 300, .height = 200, .creation = {"COMPRESS=DEFLATE"}});
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(path));
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(size / 2);
  file << std::string(64, '\xff');
  file.close();
  EXPECT_SAYS(refusal(path), "ends early or is damaged near rows");
}

// GDAL writes zeros as a hole of the file system and then takes the block for one that was never written.
TEST_F(RasterTest, ZerosThatWereWrittenAreHeights) {
  const std::string path = make({.width = 200, .height = 200, .at = [](int, int) { return 0.0; }});
  const std::vector<double> all = samples(open(path), 100);
  EXPECT_EQ(std::count(all.begin(), all.end(), 0.0), 40000);
}

TEST_F(RasterTest, BlocksNeverWrittenAreHolesWhereNodataIsDeclaredAndRefusedElsewhere) {
  const auto sparse = [&](std::optional<double> nodata, const char* tiled = "TILED=YES") {
    const std::string path = in_directory("sparse.tif");
    const char* const options[] = {"SPARSE_OK=YES", tiled, nullptr};
    GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        path.c_str(), 512, 512, 1, GDT_Float32, const_cast<char**>(options)));
    double gt[6] = {0, 1, 0, 0, 0, -1};
    dataset->SetGeoTransform(gt);
    if (nodata) dataset->GetRasterBand(1)->SetNoDataValue(*nodata);
    double seven = 7;
    EXPECT_EQ(
        dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 1, 1, &seven, 1, 1, GDT_Float64, 0, 0, nullptr),
        CE_None);
    return path;
  };
  EXPECT_SAYS(refusal(sparse({})), "parts of it were cut off or never written");
  EXPECT_EQ(refusal(sparse({}), {.nodata = {0}}), "");
  for (const char* tiled : {"TILED=YES", "TILED=NO"}) {
    const auto source = open(sparse(-9999, tiled));
    EXPECT_EQ(samples(source, 100)[0], 7);
    EXPECT_TRUE(std::isnan(samples(source, 100)[300 * 512 + 300]));
  }
}

TEST_F(RasterTest, DeclaredGivenAndNonFiniteSamplesHaveNoData) {
  const double rows[] = {-9999, 1, -32768, 2, NAN, INFINITY, -INFINITY, 3, 0, 4, 5, -9998.9};
  const auto file = RasterFile{.nodata = -9999, .at = [&](int i, int j) { return rows[4 * j + i]; }};
  const double last = static_cast<float>(-9998.9);
  EXPECT_TRUE(
      same(samples(open(make(file))), {kNoData, 1, -32768, 2, kNoData, kNoData, kNoData, 3, 0, 4, 5, last}));
  EXPECT_TRUE(same(samples(open(make(file), {.nodata = {-32768, 0, NAN}})),
                   {kNoData, 1, kNoData, 2, kNoData, kNoData, kNoData, 3, kNoData, 4, 5, last}));
  EXPECT_TRUE(std::isnan(samples(open(make(file), {.nodata = {-9998.9}})).back())) << "compared as a float";
}

TEST_F(RasterTest, NodataThatFloatsCannotHoldExactlyStillMatches) {
  const double lowest = std::numeric_limits<float>::lowest();
  for (const double declared : {-3.4028234663852886e38, -3.40282347e+38, -3.5e38}) {
    const auto s =
        samples(open(make({.nodata = declared, .at = [&](int i, int) { return i ? 1.0 : lowest; }})));
    EXPECT_TRUE(std::isnan(s[0])) << declared;
    EXPECT_EQ(s[1], 1);
  }
}

TEST_F(RasterTest, NodataBeyondAllDoublesMeansTheLowest) {
  const double lowest = std::numeric_limits<double>::lowest();
  const auto s = samples(open(make({.type = GDT_Float64, .at = [&](int i, int) { return i ? 1.0 : lowest; }}),
                              {.nodata = {-INFINITY}}));
  EXPECT_TRUE(std::isnan(s[0]));
  EXPECT_EQ(s[1], 1);
}

TEST_F(RasterTest, NodataThatIntegersCannotHoldMatchesNothing) {
  RasterOptions options{.nodata = {100.5, 1e9, -1}};
  for (const double v : samples(open(make({.type = GDT_Byte, .nodata = 300}), options)))
    EXPECT_FALSE(std::isnan(v));
}

TEST_F(RasterTest, SignedBytesKeepTheirSign) {
  const auto source = open(make({.type = GDT_Byte,
                                 .creation = {"PIXELTYPE=SIGNEDBYTE"},
                                 .at = [](int i, int j) { return double((i - 4 * j) & 255); }}),
                           {.nodata = {-8}});
  EXPECT_TRUE(same(samples(source), {0, 1, 2, 3, -4, -3, -2, -1, kNoData, -7, -6, -5}));
}

TEST_F(RasterTest, MaskedPixelsHaveNoData) {
  const auto path = make({.creation = {"INTERLEAVE=PIXEL"}}, "masked.tif", [](GDALDataset& dataset) {
    EXPECT_EQ(dataset.CreateMaskBand(GMF_PER_DATASET), CE_None);
    GByte mask[12] = {255, 255, 0, 255, 255, 255, 255, 255, 255, 255, 255, 0};
    EXPECT_EQ(dataset.GetRasterBand(1)->GetMaskBand()->RasterIO(GF_Write, 0, 0, 4, 3, mask, 4, 3, GDT_Byte, 0,
                                                                0, nullptr),
              CE_None);
  });
  EXPECT_TRUE(same(samples(open(path), 2), {0, 1, kNoData, 3, 100, 101, 102, 103, 200, 201, 202, kNoData}));
}

TEST_F(RasterTest, AnAlphaBandMasksAndIsNoChoice) {
  const auto path = make(
      {.bands = 2, .type = GDT_UInt16, .creation = {"ALPHA=YES"}}, "alpha.tif", [](GDALDataset& dataset) {
        GUInt16 alpha[12] = {0, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255};
        EXPECT_EQ(
            dataset.GetRasterBand(2)->RasterIO(GF_Write, 0, 0, 4, 3, alpha, 4, 3, GDT_UInt16, 0, 0, nullptr),
            CE_None);
      });
  const auto s = samples(open(path));
  EXPECT_TRUE(std::isnan(s[0]));
  EXPECT_EQ(s[5], 101);
}

TEST_F(RasterTest, TheFrameIsTheLatticeOfPixelCentresInBothRegistrations) {
  for (const bool point : {false, true}) {
    const auto source = open(make({.geotransform = {500, 3, 4, 900, 4, -3}, .point = point}));
    EXPECT_EQ(source.pixel_is_area(), !point);
    const Point p = source.frame().to_domain(2, 1);
    EXPECT_NEAR(p.x, 500 + 3 * 2.5 + 4 * 1.5, 1e-9);
    EXPECT_NEAR(p.y, 900 + 4 * 2.5 - 3 * 1.5, 1e-9);
  }
}

TEST_F(RasterTest, WithoutAGeotransformPixelsAreMetresAndYRunsDown) {
  const auto source = open(make({.georeferenced = false, .crs = ""}));
  EXPECT_EQ(source.frame().numbers(), (std::array<double, 6>{0.5, 1, 0, -0.5, 0, -1}));
  EXPECT_SAYS(joined_warnings(source), "no georeference: pixels taken as metres, y down");
  EXPECT_EQ(source.crs(), "");
}

TEST_F(RasterTest, ControlPointsAloneAreRefused) {
  const auto path = make({.georeferenced = false, .crs = ""}, "gcp.tif", [](GDALDataset& dataset) {
    GDAL_GCP points[4];
    GDALInitGCPs(4, points);
    for (int k = 0; k < 4; ++k) {
      points[k].dfGCPPixel = points[k].dfGCPX = k % 2;
      points[k].dfGCPLine = points[k].dfGCPY = k / 2;
    }
    EXPECT_EQ(dataset.SetGCPs(4, points, static_cast<const OGRSpatialReference*>(nullptr)), CE_None);
    GDALDeinitGCPs(4, points);
  });
  EXPECT_SAYS(refusal(path), "ground control points only; warp it first");
}

TEST_F(RasterTest, UnitScaleAndOffsetFoldIntoOneAffineMap) {
  const auto check = [&](const RasterFile& file, const RasterOptions& options, double scale, double offset) {
    const auto source = open(make(file), options);
    EXPECT_DOUBLE_EQ(source.scale(), scale);
    EXPECT_DOUBLE_EQ(source.offset(), offset);
    EXPECT_EQ(samples(source)[5], 101) << "raw samples stay as they are";
  };
  check({}, {}, 1, 0);
  check({.unit = "ft"}, {}, 0.3048, 0);
  check({.unit = "US survey foot"}, {}, 1200.0 / 3937, 0);
  check({.unit = "Metre"}, {}, 1, 0);
  check({.unit = "ft"}, {.unit = "cm"}, 0.01, 0);
  check({.scale = 0.1, .offset = 1000}, {}, 0.1, 1000);
  check({.scale = 0.1, .offset = 1000}, {.unit = "ft", .vertical_offset = -7}, 0.03048, 304.8 - 7);
  check({.scale = 0.5}, {.unit = "us-ft"}, 600.0 / 3937, 0);
  check({.scale = -1}, {.unit = "m"}, -1, 0);
}

TEST_F(RasterTest, AnUnknownUnitIsTakenAsMetresAndSaid) {
  const auto source = open(make({.unit = "kelvin"}));
  EXPECT_EQ(source.scale(), 1);
  EXPECT_SAYS(joined_warnings(source), "unit \"kelvin\" is not known: taken as metres");
}

TEST_F(RasterTest, AScaleOfZeroOrNotFiniteIsRefused) {
  for (const double scale : {0.0, double(NAN), double(INFINITY)})
    EXPECT_SAYS(refusal(make({.scale = scale})), "scale of zero, or a scale or offset that is not finite");
  EXPECT_SAYS(refusal(make({.offset = INFINITY})), "not finite");
}

TEST_F(RasterTest, AccuracyIsWhatIsGivenElseTheStatedRule) {
  EXPECT_EQ(open(make({}), {.accuracy = 1.25}).accuracy(), 1.25);
  EXPECT_SAYS(joined_warnings(open(make({}))), "no accuracy given: taken as 0.20 m");
  EXPECT_DOUBLE_EQ(open(make({})).accuracy(), 0.2);
  EXPECT_DOUBLE_EQ(open(make({.type = GDT_Int16})).accuracy(), 0.5) << "half a raw unit";
  EXPECT_DOUBLE_EQ(open(make({.type = GDT_Int16, .scale = 0.01})).accuracy(), 0.2);
  EXPECT_EQ(joined_warnings(open(make({}), {.accuracy = 0})), "");
}

}  // namespace
}  // namespace patchwork
