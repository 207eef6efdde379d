// patchwork resample: the GeoTIFF as GDAL reads it, its agreement with sample, and the pictures beside it.
#include <signal.h>
#include <sys/resource.h>

#include "tests/cli/command.h"

namespace patchwork {

class Resample : public CliTest {
 protected:
  Resample() {
    json({"import", database_, make(hill_file(200, 150), "base.tif"), "--accuracy", "0.5", "--json"});
    json({"import", database_, make(hill_file(100, 80, 503, -407, 4), "fine.tif"), "--accuracy", "0.1",
          "--json"});
  }
  Words command(const Words& options) const {
    Words words{"resample", database_, out_};
    words.insert(words.end(), options.begin(), options.end());
    return words;
  }
  static GDALDatasetUniquePtr opened(const std::string& path) {
    return GDALDatasetUniquePtr(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  }
  static std::vector<float> band(GDALDataset& d, int number) {
    std::vector<float> v(size_t(d.GetRasterXSize()) * size_t(d.GetRasterYSize()));
    EXPECT_EQ(
        d.GetRasterBand(number)->RasterIO(GF_Read, 0, 0, d.GetRasterXSize(), d.GetRasterYSize(), v.data(),
                                          d.GetRasterXSize(), d.GetRasterYSize(), GDT_Float32, 0, 0, nullptr),
        CE_None);
    return v;
  }
  const std::string database_ = in_directory("d.pwk"), out_ = in_directory("out.tif");
};

TEST_F(Resample, GdalReadsPlaceCrsBandsAndOverviews) {
  const Json j = json(command({"--step", "2.5", "--bands", "height,bound,source", "--json"}));
  for (const char* key :
       {"seconds", "samples", "patches", "bound_max", "stages", "contributors_mean", "contributors_max"})
    EXPECT_TRUE(j.contains(key)) << key;
  for (const char* key : {"query", "fetch", "blend", "write"}) EXPECT_TRUE(j["stages"].contains(key)) << key;
  const auto d = opened(out_);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->GetRasterXSize(), 800);
  EXPECT_EQ(d->GetRasterYSize(), 600);
  EXPECT_EQ(j["samples"], 800 * 600);
  double gt[6];
  ASSERT_EQ(d->GetGeoTransform(gt), CE_None);
  EXPECT_NEAR(gt[0], 500000, 1e-6);
  EXPECT_NEAR(gt[3], 5000000, 1e-6);
  EXPECT_EQ(gt[1], 2.5);
  EXPECT_EQ(gt[5], -2.5);
  EXPECT_STREQ(d->GetSpatialRef()->GetAuthorityCode(nullptr), "26710");
  EXPECT_STREQ(d->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  ASSERT_EQ(d->GetRasterCount(), 3);
  for (const auto& [number, name] :
       std::vector<std::pair<int, std::string>>{{1, "height"}, {2, "bound"}, {3, "source"}}) {
    GDALRasterBand& b = *d->GetRasterBand(number);
    EXPECT_EQ(b.GetDescription(), name);
    EXPECT_EQ(b.GetRasterDataType(), GDT_Float32);
    EXPECT_TRUE(std::isnan(b.GetNoDataValue()));
    EXPECT_EQ(b.GetOverviewCount(), 1);
    EXPECT_EQ(std::string(b.GetUnitType()), name == "source" ? "" : "m");
  }
  EXPECT_STREQ(d->GetRasterBand(3)->GetMetadataItem("SOURCE_2"), "fine");
}

TEST_F(Resample, EveryPixelAgreesWithSample) {
  json(command({"--extent", "500400", "4999300", "500700", "4999600", "--step", "7", "--bands",
                "source,height,bound", "--error", "0.3", "--json"}));
  const auto d = opened(out_);
  ASSERT_TRUE(d);
  EXPECT_STREQ(d->GetRasterBand(1)->GetDescription(), "source") << "bands in the order asked for";
  const int w = d->GetRasterXSize(), h = d->GetRasterYSize();
  EXPECT_EQ(w, 43);
  double gt[6];
  d->GetGeoTransform(gt);
  std::ostringstream points;
  points.precision(17);
  for (int j = 0; j < h; ++j)
    for (int i = 0; i < w; ++i)
      points << gt[0] + (i + 0.5) * gt[1] << " " << gt[3] + (j + 0.5) * gt[5] << "\n";
  const Words lines =
      lines_of(run({"sample", database_, "--error", "0.3", "--quiet"}, {.input = points.str()}).out);
  ASSERT_EQ(lines.size(), size_t(w * h));
  const auto source = band(*d, 1), height = band(*d, 2), bound = band(*d, 3);
  std::size_t wrong = 0, fine = 0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    std::istringstream in(lines[k]);
    double x, y, z, e;
    std::string name;
    in >> x >> y >> z >> e >> name;
    // The bound counts that its height was rounded to float32.
    wrong += !(std::abs(height[k] - z) <= 1e-4 && bound[k] >= e + std::abs(height[k] - z) - 1e-9 &&
               bound[k] <= e * 1.000001 + 1e-4);
    wrong += source[k] != (name == "fine" ? 2 : 1);
    fine += name == "fine";
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(fine, 100u);
  EXPECT_LT(fine, lines.size() - 100) << "both grids speak";
}

TEST_F(Resample, BeyondTheDataThereIsNone) {
  json(command({"--extent", "499900", "4999000", "500100", "4999200", "--step", "10", "--bands",
                "height,bound,source", "--json"}));
  const auto d = opened(out_);
  ASSERT_TRUE(d);
  EXPECT_TRUE(std::isnan(band(*d, 1)[5]));
  EXPECT_TRUE(std::isnan(band(*d, 2)[5]));
  EXPECT_TRUE(std::isnan(band(*d, 3)[5]));
  EXPECT_TRUE(std::isfinite(band(*d, 1)[15]));
  EXPECT_SAYS(complaint(run(command({"--extent", "0", "0", "1", "1"}))), "no grid meets the extent");
  EXPECT_SAYS(complaint(run(command({"--extent", "9", "0", "1", "1"}))), "extent");
}

// The last pixels' centres may lie beyond what is asked for, and have data.
TEST_F(Resample, AnExtentThatIsNoMultipleOfTheStepHasNoRimWithoutData) {
  const auto missing = [&](const char* xmax, const char* ymin) {
    json(command({"--extent", "500000", ymin, xmax, "5000000", "--step", "300", "--json"}));
    const auto d = opened(out_);
    EXPECT_EQ(d->GetRasterXSize(), 5);
    EXPECT_EQ(d->GetRasterYSize(), 4);
    const std::vector<float> heights = band(*d, 1);
    return std::count_if(heights.begin(), heights.end(), [](float h) { return std::isnan(h); });
  };
  EXPECT_EQ(missing("501210", "4999090"), 0);
  EXPECT_EQ(missing("501500", "4998800"), 0) << "a multiple";
}

TEST_F(Resample, StepIsTheFinestThereUnlessGiven) {
  EXPECT_EQ(json(command({"--json"}))["width"], 500) << "4 m of the finer grid, over 2 km";
  EXPECT_EQ(json(command({"--extent", "500000", "4999800", "500100", "4999900", "--json"}))["width"], 10);
}

TEST_F(Resample, PicturesAreWritten) {
  const std::string shade = in_directory("shade.png"), map = in_directory("map.png");
  json(command({"--step", "10", "--hillshade", shade, "--map", map, "--json"}));
  for (const std::string& path : {shade, map}) {
    const auto picture = opened(path);
    ASSERT_TRUE(picture) << path;
    EXPECT_GE(picture->GetRasterXSize(), 200);
    EXPECT_STREQ(picture->GetDriverName(), "PNG");
  }
  EXPECT_NE(text_of(shade), text_of(map));
  EXPECT_EQ(run(command({"--step", "10", "--map", in_directory("none/map.png")})).code, 1);
}

TEST_F(Resample, NothingIsWrittenOverTheDatabaseOrHalf) {
  const std::string before = content_hash(database_);
  EXPECT_SAYS(complaint(run({"resample", database_, database_})), "the database itself");
  EXPECT_SAYS(complaint(run(command({"--map", database_}))), "the database itself");
  for (const Words& words :
       {Words{"export", database_, "hills", database_}, Words{"render", database_, database_},
        Words{"render", database_, in_directory("p.png"), "--depth", database_},
        Words{"accuracy", database_, "--map", database_}})
    EXPECT_SAYS(complaint(run(words)), "the database itself");
  const std::string twice = in_directory("twice.tif");
  EXPECT_SAYS(complaint(run({"resample", database_, twice, "--map", twice})), "two outputs");
  EXPECT_EQ(content_hash(database_), before);
  EXPECT_SAYS(complaint(run({"resample", database_, in_directory("none/out.tif")})), "none/out.tif");
  EXPECT_FALSE(std::filesystem::exists(out_));

  const auto fill_disk = [] {
    const rlimit limit{100000, 100000};
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, SIG_IGN);
  };
  EXPECT_EQ(run(command({}), {.in_child = fill_disk}).code, 1);
  std::size_t tiffs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(in_directory("")))
    tiffs += entry.path().filename().string().find("out.tif") != std::string::npos;
  EXPECT_EQ(tiffs, 0u) << "no part of it is left";
  EXPECT_EQ(run(command({})).code, 0);
  EXPECT_TRUE(std::filesystem::exists(out_));
}

TEST_F(Resample, SmoothnessBlendAndCompressionAreTaken) {
  std::vector<std::vector<float>> heights;
  for (const Words& options : {Words{}, Words{"--smoothness", "1"}, Words{"--smoothness", "2"},
                               Words{"--blend", "weighted"}, Words{"--compress", "ZSTD"}}) {
    Words words = command({"--step", "3", "--error", "0.3"});
    words.insert(words.end(), options.begin(), options.end());
    EXPECT_EQ(run(words).code, 0);
    const auto d = opened(out_);
    ASSERT_TRUE(d);
    heights.push_back(band(*d, 1));
  }
  for (std::size_t k = 1; k < 4; ++k) EXPECT_NE(heights[k], heights[0]) << k;
  const auto same = [&](std::size_t p) {
    return heights[4][p] == heights[0][p] || (std::isnan(heights[4][p]) && std::isnan(heights[0][p]));
  };
  std::size_t different = 0;
  for (std::size_t p = 0; p < heights[0].size(); ++p) different += !same(p);
  EXPECT_EQ(different, 0u) << "compression is lossless";
}

TEST_F(Resample, OnTheGraphicsCardTheHeightsAreTheCpus) {
  for (const char* smoothness : {"0", "2"}) {
    const Words options{"--step",       "2.5",      "--bands", "height,bound,source",
                        "--smoothness", smoothness, "--json"};
    const Json cpu = json(command(options));
    std::vector<std::vector<float>> want;
    for (int b = 1; b <= 3; ++b) want.push_back(band(*opened(out_), b));
    Words words = options;
    words.insert(words.end(), {"--engine", "vulkan"});
    const Json gpu = json(command(words));
    EXPECT_EQ(gpu["samples"], cpu["samples"]);
    EXPECT_EQ(cpu["engine"], "cpu");
    EXPECT_NE(gpu["engine"], "cpu");
    for (int b = 1; b <= 3; ++b) {
      const std::vector<float> got = band(*opened(out_), b);
      for (std::size_t k = 0; k < got.size(); ++k)
        ASSERT_TRUE(std::abs(got[k] - want[size_t(b - 1)][k]) <= 2e-3 ||
                    (std::isnan(got[k]) && std::isnan(want[size_t(b - 1)][k])))
            << "band " << b << " pixel " << k << ": " << got[k] << " " << want[size_t(b - 1)][k];
    }
  }
}

}  // namespace patchwork
