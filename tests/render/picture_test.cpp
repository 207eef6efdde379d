#include "render/picture.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "db/error.h"
#include "render/hillshade.h"
#include "render/patch_map.h"

// fontconfig keeps patterns behind offsets that the leak checker cannot follow.
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig"; }

namespace patchwork {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr Color kWhite{0xff, 0xff, 0xff};

std::mt19937 seeded() {
  const char* given = std::getenv("PATCHWORK_SEED");
  const auto seed = given ? std::uint32_t(std::strtoul(given, nullptr, 10)) : std::random_device{}();
  std::cout << "PATCHWORK_SEED=" << seed << '\n';
  return std::mt19937(seed);
}

std::string temporary(const std::string& name) {
  return (std::filesystem::path(testing::TempDir()) / (std::to_string(getpid()) + name)).string();
}

// GDAL's PNG reader is another implementation than the writer under test.
Image read_png(const std::string& path) {
  GDALAllRegister();
  GDALDataset* file = GDALDataset::Open(path.c_str(), GDAL_OF_RASTER);
  if (!file || file->GetRasterCount() != 3) return {};
  Image image(file->GetRasterXSize(), file->GetRasterYSize(), {});
  const CPLErr error =
      file->RasterIO(GF_Read, 0, 0, image.width, image.height, image.pixels.data(), image.width, image.height,
                     GDT_Byte, 3, nullptr, 3, 3 * image.width, 1, nullptr);
  GDALClose(file);
  return error == CE_None ? image : Image{};
}

Image noise(int width, int height, std::mt19937& random) {
  Image image(width, height, {});
  for (Color& c : image.pixels) {
    const auto v = random();
    c = {std::uint8_t(v), std::uint8_t(v >> 8), std::uint8_t(v >> 16)};
  }
  return image;
}

// How many pixels have each colour.
auto histogram(const Image& image) {
  std::map<std::tuple<int, int, int>, int> counts;
  for (Color c : image.pixels) ++counts[{c.r, c.g, c.b}];
  return counts;
}

TEST(Picture, PngComesBackPixelForPixel) {
  std::mt19937 random = seeded();
  const std::string path = temporary("_round.png");
  for (auto [width, height] : {std::pair{1, 1}, {3, 5}, {257, 31}}) {
    Image image = noise(width, height, random);
    write_png(path, image);
    const Image read = read_png(path);
    ASSERT_EQ(std::pair(read.width, read.height), std::pair(width, height));
    EXPECT_EQ(read.pixels, image.pixels);
    image.pixels.back().b ^= 1;
    EXPECT_NE(read.pixels, image.pixels);
  }
  std::filesystem::remove(path);
  std::filesystem::remove(path + ".aux.xml");
}

TEST(Picture, RefusesWhatCannotBeWrittenAndLeavesNothing) {
  EXPECT_THROW(write_png(temporary("_empty.png"), Image{}), Error);
  EXPECT_THROW(write_png(temporary("_no/such/folder.png"), Image(2, 2, {})), Error);
  std::mt19937 random(1);
  const Image large = noise(200, 200, random);
  const std::string path = temporary("_full.png");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{10000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_png(path, large), Error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_NO_THROW(write_png(path, large));
  EXPECT_TRUE(std::filesystem::remove(path));
}

TEST(Picture, DrawingStaysWhereItWasAsked) {
  Canvas canvas(40, 30, kWhite);
  canvas.fill_rect(10, 5, 4, 3, {200, 0, 0});
  canvas.picture(36, 28, Image(10, 10, {0, 0, 200}));  // cut off at the border
  const std::vector<Point> corners = {{-50, -50}, {90, -50}, {90, 20}, {-50, 20}};
  canvas.outline(corners, 2, {0, 200, 0}, 1, {0, 0, 5, 30});
  auto counts = histogram(canvas.image());
  EXPECT_EQ((counts[{200, 0, 0}]), 12);
  EXPECT_EQ((counts[{0, 0, 200}]), 8);
  EXPECT_EQ((counts[{0, 200, 0}]), 10) << "2 pixels of line in the 5 pixels of the clip";
  EXPECT_EQ((counts[{255, 255, 255}]), 40 * 30 - 30);
}

TEST(Picture, FittedTextIsNeverWiderThanItsPlace) {
  Canvas canvas(10, 10, kWhite);
  const std::string name = "Größe über alles – ein langer Name";
  EXPECT_EQ(canvas.fitted(name, 10000), name);
  EXPECT_GT(canvas.text_width(name), 200);
  for (double width = 20; width < 200; width += 7) {
    const std::string cut = canvas.fitted(name, width);
    EXPECT_LE(canvas.text_width(cut), width);
    EXPECT_EQ(cut.substr(cut.size() - 3), "…");
    EXPECT_EQ(name.rfind(cut.substr(0, cut.size() - 3), 0), 0u) << "a beginning of the name";
  }
}

TEST(Picture, RoundDownIsTheNextOneTwoOrFiveBelow) {
  std::mt19937 random = seeded();
  std::uniform_real_distribution<double> exponent(-6, 9);
  for (int n = 0; n < 10000; ++n) {
    const double value = std::pow(10.0, exponent(random)), round = round_down_125(value);
    EXPECT_LE(round, value);
    EXPECT_GT(2.5 * round, value * (1 - 1e-12));
    const double mantissa = round / std::pow(10.0, std::floor(std::log10(round) + 1e-9));
    EXPECT_LT(std::min({std::abs(mantissa - 1), std::abs(mantissa - 2), std::abs(mantissa - 5)}), 1e-9)
        << round;
  }
  EXPECT_EQ(round_down_125(1000), 1000);
  EXPECT_EQ(round_down_125(999), 500);
}

TEST(Picture, LengthsReadAsMetresOrKilometres) {
  EXPECT_EQ(length_text(250), "250 m");
  EXPECT_EQ(length_text(0.5), "0.5 m");
  EXPECT_EQ(length_text(1500), "1.5 km");
  EXPECT_EQ(length_text(20000), "20 km");
}

// Where hillshade() puts the map of an untitled picture.
constexpr int kMapCorner = 24;

std::vector<float> sampled(int width, int height, double (*z)(double, double)) {
  std::vector<float> heights;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) heights.push_back(float(z(x, y)));
  return heights;
}

int brightness(Color c) { return c.r + c.g + c.b; }

TEST(Hillshade, SlopesTowardsTheLightAreBrighterThanSlopesAway) {
  const auto middle = [](double (*z)(double, double)) {
    return brightness(hillshade(sampled(600, 600, z), 600, 600, 10).at(kMapCorner + 300, kMapCorner + 300));
  };
  const int towards = middle([](double x, double y) { return 3 * (x + y); });
  const int across = middle([](double x, double y) { return 3 * (x - y); });
  const int away = middle([](double x, double y) { return -3 * (x + y); });
  EXPECT_GT(towards, across + 20);
  EXPECT_GT(across, away + 20);
}

TEST(Hillshade, GapsAreHatchedToThePixel) {
  std::vector<float> heights = sampled(600, 520, [](double x, double y) { return std::sin(x / 20) * y; });
  for (int y = 100; y < 180; ++y)
    for (int x = 50 + y; x < 333; ++x) heights[size_t(y * 600 + x)] = kNan;
  heights[0] = std::numeric_limits<float>::infinity();
  const Image image = hillshade(heights, 600, 520, 10);
  int wrong = 0, hatched = 0;
  for (int y = 0; y < 520; ++y)
    for (int x = 0; x < 600; ++x) {
      const bool gap = !std::isfinite(heights[size_t(y * 600 + x)]);
      const bool shown = image.at(kMapCorner + x, kMapCorner + y) == hatch_color(x, y);
      wrong += gap != shown, hatched += shown;
    }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(hatched, 5000);
}

TEST(Hillshade, LargerRastersAreAveraged) {
  const auto colors_in_the_map = [](int size) {
    const auto heights = sampled(size, size, [](double x, double y) { return int(x + y) % 2 ? 100.0 : 0.0; });
    const Image image = hillshade(heights, size, size, 10);
    Image map(500, 500, {});
    for (int y = 0; y < 500; ++y)
      for (int x = 0; x < 500; ++x) map.at(x, y) = image.at(kMapCorner + 50 + x, kMapCorner + 50 + y);
    return histogram(map).size();
  };
  EXPECT_EQ(colors_in_the_map(2300), 1u) << "2 x 2 samples of a chequerboard have one mean";
  EXPECT_GT(colors_in_the_map(1001), 1u);
}

TEST(Hillshade, IsLegibleWhateverTheSize) {
  for (auto [width, height] : {std::pair{1, 1}, {2, 2}, {1, 3000}, {3000, 3}, {87, 61}, {1600, 1100}}) {
    const Image image =
        hillshade(sampled(width, height, [](double x, double y) { return x * y; }), width, height, 30);
    EXPECT_GE(std::max(image.width, image.height), 700) << width;
    EXPECT_LE(std::max(image.width, image.height), 1400) << width;
  }
}

TEST(Hillshade, TakesPlainsAndNothingAtAll) {
  EXPECT_NO_THROW(hillshade(std::vector<float>(900, 12.5f), 30, 30, 1, "level"));
  EXPECT_NO_THROW(hillshade(std::vector<float>(900, kNan), 30, 30, 1, "nothing"));
}

TEST(Hillshade, RefusesSizesAndStepsThatAreNone) {
  const std::vector<float> heights(12, 1.0f);
  EXPECT_NO_THROW(hillshade(heights, 4, 3, 1));
  EXPECT_THROW(hillshade(heights, 4, 4, 1), Error);
  EXPECT_THROW(hillshade({}, 0, 0, 1), Error);
  EXPECT_THROW(hillshade(heights, 4, 3, 0), Error);
  EXPECT_THROW(hillshade(heights, 4, 3, kNan), Error);
}

// A square map: column c of the input holds sizes[c] and grids[c].
struct Columns {
  std::vector<float> sizes;
  std::vector<std::uint16_t> grids;
  std::vector<std::uint8_t> filled{};

  Image draw(std::vector<std::array<Point, 4>> outlines = {}) const {
    const int n = int(sizes.size());
    std::vector<float> kernel_metres;
    std::vector<std::uint16_t> grid;
    std::vector<std::uint8_t> fill;
    std::vector<std::string> names;
    for (int r = 0; r < n; ++r) {
      kernel_metres.insert(kernel_metres.end(), sizes.begin(), sizes.end());
      grid.insert(grid.end(), grids.begin(), grids.end());
      fill.insert(fill.end(), filled.begin(), filled.end());
    }
    for (int g = 0; g < 30; ++g) names.push_back("grid " + std::to_string(g));
    return patch_map({.width = n,
                      .height = n,
                      .kernel_metres = kernel_metres,
                      .grid = grid,
                      .filled = fill,
                      .grid_names = names,
                      .outlines = std::move(outlines),
                      .title = "columns",
                      .step_metres = 10});
  }
};

// The panels of a square map: 640 pixels wide.
constexpr int kLeftPanel = 24, kRightPanel = 24 + 640 + 32, kPanelTop = 90, kPanelSide = 640;

// The colour in the middle of column `c` of `n`.
Color column(const Image& image, int panel, int c, int n) {
  return image.at(panel + (2 * c + 1) * kPanelSide / (2 * n), kPanelTop + kPanelSide / 3);
}

TEST(PatchMap, EqualSizesAndGridsHaveEqualColoursAndOthersOther) {
  const Image image = Columns{{280, 280, 560, 4480}, {5, 2, 2, 2}}.draw();
  const auto size = [&](int c) { return column(image, kLeftPanel, c, 4); };
  const auto grid = [&](int c) { return column(image, kRightPanel, c, 4); };
  EXPECT_EQ(size(0), size(1));
  EXPECT_NE(size(1), size(2));
  EXPECT_NE(size(2), size(3));
  EXPECT_GT(size(0).r, size(0).b) << "small is red";
  EXPECT_LT(size(3).r, size(3).b) << "large is blue";
  EXPECT_NE(grid(0), grid(1));
  EXPECT_EQ(grid(1), grid(3));
}

TEST(PatchMap, WhereNothingAnswersBothPanelsAreHatched) {
  const Image image = Columns{{kNan, 280}, {77, 0}}.draw();
  for (int panel : {kLeftPanel, kRightPanel})
    for (int x = 0; x < kPanelSide; ++x) {
      const Color c = image.at(panel + x, kPanelTop + 100);
      // The frame's antialiasing touches no pixel of the panel.
      EXPECT_EQ(c == hatch_color(x, 100), x < kPanelSide / 2) << panel << ' ' << x;
    }
}

TEST(PatchMap, FilledCellsAreStripedInTheirGridsColour) {
  const Image image = Columns{{280, 280}, {0, 0}, {0, 1}}.draw();
  const Color plain = column(image, kRightPanel, 0, 2);
  int same = 0;
  for (int x = kPanelSide / 2; x < kPanelSide; ++x)
    same += image.at(kRightPanel + x, kPanelTop + 50) == plain;
  EXPECT_GT(same, 100);
  EXPECT_LT(same, 300);
  for (int x = 0; x < kPanelSide / 2; ++x) EXPECT_EQ(image.at(kRightPanel + x, kPanelTop + 50), plain);
}

TEST(PatchMap, OutlinesLieOnTheLeftPanelOnly) {
  const Columns columns{{280, 560}, {0, 1}};
  const Image bare = columns.draw(), drawn = columns.draw({{{{-1, 0.5}, {9, 0.5}, {9, 1.5}, {-1, 1.5}}}});
  ASSERT_EQ(bare.width, drawn.width);
  ASSERT_EQ(bare.height, drawn.height);
  int inside = 0, outside = 0;
  for (int y = 0; y < bare.height; ++y)
    for (int x = 0; x < bare.width; ++x) {
      const bool in =
          x >= kLeftPanel && x < kLeftPanel + kPanelSide && y >= kPanelTop && y < kPanelTop + kPanelSide;
      (in ? inside : outside) += bare.at(x, y) != drawn.at(x, y);
    }
  EXPECT_GE(inside, 2 * kPanelSide);
  EXPECT_EQ(outside, 0);
}

TEST(PatchMap, ManySizesAndGridsShareAFewColours) {
  Columns columns;
  for (int c = 0; c < 30; ++c) {
    columns.sizes.push_back(float(10 * std::pow(1.5, c)));
    columns.grids.push_back(std::uint16_t(c));
  }
  const Image image = columns.draw();
  std::map<int, int> sizes, grids;
  for (int c = 0; c < 30; ++c) {
    ++sizes[brightness(column(image, kLeftPanel, c, 30))];
    ++grids[brightness(column(image, kRightPanel, c, 30))];
  }
  EXPECT_GE(sizes.size(), 7u);
  EXPECT_LE(sizes.size(), 9u);
  EXPECT_EQ(grids.size(), 9u) << "eight grids and the others";
}

TEST(PatchMap, RefusesSpansOfAnotherSizeAndUnnamedGrids) {
  const std::vector<float> sizes(6, 280.0f);
  const std::vector<std::uint16_t> grids(6, 0), unnamed(6, 3);
  const std::vector<std::uint8_t> filled(5, 1);
  PatchMapInput in{.width = 3, .height = 2, .kernel_metres = sizes, .grid = grids, .grid_names = {"a"}};
  EXPECT_NO_THROW(patch_map(in));
  in.filled = filled;
  EXPECT_THROW(patch_map(in), Error);
  in.filled = {};
  in.height = 3;
  EXPECT_THROW(patch_map(in), Error);
  in.height = 2;
  in.grid = unnamed;
  EXPECT_THROW(patch_map(in), Error);
  EXPECT_THROW(patch_map({}), Error);
}

}  // namespace
}  // namespace patchwork
