#include "tools/raster_field.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "db/error.h"
#include "tools/terrain_writer.h"

namespace patchwork {
namespace {

// A field whose heights are a formula.
struct Formula : HeightField {
  explicit Formula(double (*formula)(double, double)) : f(formula) {}
  void heights(std::span<const double> x, std::span<const double> y, std::span<double> out) const override {
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = f(x[k], y[k]);
  }
  double (*f)(double, double);
};

class Scratch : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("patchwork_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }

  std::filesystem::path folder_;
};

using SurveyFile = Scratch;
using RasterFieldFile = Scratch;

double hills(double x, double y) { return 500 + 40 * std::sin(x / 90) * std::cos(y / 70); }

// 60 x 40 samples of 10 m about (500 000, 4 000 000), turned by 30 degrees.
SurveyPlan turned_plan() {
  return {.geotransform = survey_geotransform({500000, 4000000}, 60, 40, 10, 30), .width = 60, .height = 40};
}

double height_at(const HeightField& field, double x, double y) {
  double h = 0;
  field.heights({&x, 1}, {&y, 1}, {&h, 1});
  return h;
}

// The largest distance of the file's valid samples from the formula, at the places that the file claims for
// them.
double largest_sample_error(const std::string& path, long long& voids) {
  const std::unique_ptr<GDALDataset> file(GDALDataset::Open(path.c_str()));
  std::array<double, 6> gt{};
  file->GetGeoTransform(gt.data());
  const Frame frame = Frame::from_geotransform(gt, path);
  GDALRasterBand* band = file->GetRasterBand(1);
  const int w = file->GetRasterXSize(), h = file->GetRasterYSize();
  std::vector<double> raw(std::size_t(w) * std::size_t(h), 0.);
  EXPECT_EQ(band->RasterIO(GF_Read, 0, 0, w, h, raw.data(), w, h, GDT_Float64, 0, 0, nullptr), CE_None);
  double worst = 0;
  voids = 0;
  for (int k = 0; k < w * h; ++k) {
    const double value = raw[std::size_t(k)];
    if (value == band->GetNoDataValue()) {
      ++voids;
      continue;
    }
    const Point p = frame.to_domain(k % w, k / w);
    worst = std::max(worst, std::abs(value * band->GetScale() - hills(p.x, p.y)));
  }
  return worst;
}

TEST_F(SurveyFile, SamplesLieWithinRoundingAndNoiseWhereTheFileSaysTheyAre) {
  for (const char* type : {"Int16", "UInt16", "Int32", "Float32"}) {
    SurveyPlan plan = turned_plan();
    plan.noise = 0.3;
    const SampleFormat format{.type = type, .quantum = 0.1, .crs = "EPSG:32616"};
    const SurveyFacts facts = write_survey(Formula(hills), plan, format, path("a.tif"));
    long long voids = 0;
    const double error = largest_sample_error(path("a.tif"), voids);
    EXPECT_LE(error, facts.rounding + plan.noise + 1e-6) << type;
    EXPECT_GT(error, 0.5 * plan.noise) << type;  // the negative control: noise there is
    EXPECT_GE(facts.accuracy, facts.interpolation_error + facts.rounding + plan.noise) << type;
    EXPECT_EQ(voids, 0) << type;
  }
}

TEST_F(SurveyFile, HolesTakeAboutTheShareAskedFor) {
  SurveyPlan plan{.geotransform = {0, 5, 0, 0, 0, -5}, .width = 640, .height = 640, .holes = 0.1};
  const SurveyFacts facts = write_survey(Formula(hills), plan, {.type = "Int16"}, path("holes.tif"));
  long long voids = 0;
  EXPECT_LE(largest_sample_error(path("holes.tif"), voids), 0.05 + 1e-6);
  EXPECT_EQ(voids, facts.voids);
  EXPECT_NEAR(double(voids) / (640 * 640), 0.1, 0.03);
}

TEST_F(SurveyFile, CentreOfATurnedSurveyIsWhereItWasAskedFor) {
  const auto g = survey_geotransform({7, 9}, 5, 3, 2, 90);
  EXPECT_NEAR(g[0] + g[1] * 2 + g[2] * 1, 7, 1e-12);
  EXPECT_NEAR(g[3] + g[4] * 2 + g[5] * 1, 9, 1e-12);
  EXPECT_NEAR(g[4], -2, 1e-12);  // at 90 degrees the i axis runs south
}

TEST_F(SurveyFile, RefusesWhatItCannotStore) {
  const SurveyPlan plan = turned_plan();
  const Formula field(hills);
  EXPECT_THROW(write_survey(field, plan, {.type = "Int16", .quantum = 0.01}, path("a.tif")), Error);
  EXPECT_THROW(write_survey(field, plan, {.type = "Int8"}, path("a.tif")), Error);
  EXPECT_THROW(write_survey(field, plan, {.crs = "nowhere"}, path("a.tif")), Error);
  EXPECT_THROW(write_survey(field, plan, {}, path("no/such/folder.tif")), Error);
}

TEST_F(RasterFieldFile, GoesThroughTheFilesSamplesAndStaysWithinItsAccuracy) {
  const SurveyPlan plan = turned_plan();
  write_survey(Formula(hills), plan, {.crs = "EPSG:32616"}, path("a.tif"));
  const RasterField exact(path("a.tif"), {.crs = "EPSG:32616", .detail = 0});
  const RasterField detailed(path("a.tif"), {.crs = "EPSG:32616", .detail = 2});
  const auto& g = plan.geotransform;
  double largest_detail = 0;
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 60; ++i) {
      const double x = g[0] + (g[1] * i + g[2] * j), y = g[3] + (g[4] * i + g[5] * j);
      ASSERT_NEAR(height_at(exact, x, y), hills(x, y), 1e-4);
      largest_detail = std::max(largest_detail, std::abs(height_at(detailed, x, y) - hills(x, y)));
    }
  EXPECT_LE(largest_detail, 2.0001);
  EXPECT_GT(largest_detail, 0.2);  // the negative control: detail there is
  EXPECT_NEAR(detailed.source_accuracy(), exact.source_accuracy() + 2, 1e-12);
  EXPECT_LT(exact.source_accuracy(), 1);
}

TEST_F(RasterFieldFile, AnswersInAnotherCoordinateSystem) {
  write_survey(Formula(hills), turned_plan(), {.crs = "EPSG:32616"}, path("a.tif"));
  const RasterField own(path("a.tif"), {.crs = "EPSG:32616", .detail = 0});
  const RasterField geographic(path("a.tif"), {.crs = "EPSG:4326", .detail = 0});
  const Extent e = geographic.extent();
  EXPECT_TRUE(e.contains({-87, 36.1447}));  // longitude first, whatever EPSG says
  // The central meridian of zone 16 is easting 500 000.
  EXPECT_NEAR(height_at(geographic, -87, 0.5 * (e.ymin + e.ymax)), height_at(own, 500000, 4000000), 1);
}

TEST_F(RasterFieldFile, RefusesVoidsAndFilesThatAreNone) {
  SurveyPlan plan = turned_plan();
  plan.holes = 0.2;
  write_survey(Formula(hills), plan, {.crs = "EPSG:32616"}, path("holes.tif"));
  EXPECT_THROW(RasterField(path("holes.tif"), {}), Error);
  EXPECT_THROW(RasterField(path("absent.tif"), {}), Error);
  plan.holes = 0;
  write_survey(Formula(hills), plan, {.crs = "EPSG:32616"}, path("sound.tif"));
  EXPECT_NO_THROW(RasterField(path("sound.tif"), {}));
  EXPECT_THROW(RasterField(path("sound.tif"), {.crs = "nowhere"}), Error);
}

}  // namespace
}  // namespace patchwork
