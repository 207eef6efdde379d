// Five scenes against the pictures in tests/pictures, which somebody looked at. A picture that differs is
// written beside its difference. PATCHWORK_WRITE_PICTURES=1 makes them anew: look at them.
#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "render/renderer.h"
#include "tests/blend/vulkan_scene.h"

namespace patchwork {
namespace {

constexpr int kWidth = 480, kHeight = 270;

Image read_png(const std::string& path) {
  GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str()));
  if (!file) throw Error(path, "it cannot be read");
  Image image(file->GetRasterXSize(), file->GetRasterYSize(), {});
  for (int band = 0; band < 3; ++band)
    EXPECT_EQ(file->GetRasterBand(band + 1)->RasterIO(GF_Read, 0, 0, image.width, image.height,
                                                      &image.pixels[0].r + band, image.width, image.height,
                                                      GDT_Byte, 3, 3 * image.width, nullptr),
              CE_None);
  return image;
}

int distance(Color a, Color b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

// Real hills of 90 m, and a survey of 12 m, turned, that adds what a coarse grid cannot know: terraces.
class PicturesTest : public VulkanTest {
 protected:
  void SetUp() override {
    VulkanTest::SetUp();
    GDALAllRegister();
    Database db = Database::open_or_create(folder_.path("land.pwk"), "EPSG:32616");
    db.import(
        RasterSource::open(std::string(PATCHWORK_TEST_DATA) + "/jacksboro.tif", {.accuracy = 8}, db.crs()),
        {.name = "base"});
  }
  Database reader() const { return Database::open(folder_.path("land.pwk")); }

  void insert_survey() {
    Database db = Database::open_or_create(folder_.path("land.pwk"), "EPSG:32616");
    const Extraction x = extract(db, {.error = 0});
    const Blend base(db, x.patches, {.smoothness = 1});
    GridFile file{.width = 240, .height = 200, .geotransform = rotated(743200, 4057600, -24, 12, 12)};
    const Frame frame = Frame::from_geotransform(file.geotransform, "survey");
    file.at = [&](int i, int j) {
      const Point p = frame.to_domain(i, j);
      Answers a(1);
      base.at_points(std::span(&p.x, 1), std::span(&p.y, 1), a.out());
      return a.height[0] + 6 * std::sin(a.height[0] / 9);
    };
    db.import(
        RasterSource::open(folder_.write(file, "survey"), {.crs = "EPSG:32616", .accuracy = 0.5}, db.crs()),
        {.name = "survey"});
  }

  // Pixels that differ by more than 12 of 255 may be 1 in 100: drivers round edges of triangles differently.
  void expect_picture(const Scene& s, const std::string& name) const {
    const Database db = reader();
    Renderer r(
        test_device(), db,
        {.width = kWidth,
         .height = kHeight,
         .pixel_error = s.pixel_error,
         .memory = std::size_t{256} << 20,
         .background = s.background,
         .tessellation = Tessellation::hardware,  // on every device, lest contour lines move within the error
         .effects = s.effects});
    r.draw(s.view());
    const Image drawn = r.picture();
    const std::string golden = PATCHWORK_TEST_PICTURES "/" + name + ".png";
    if (std::getenv("PATCHWORK_WRITE_PICTURES")) return write_png(golden, drawn);
    const Image expected = read_png(golden);
    ASSERT_EQ(expected.pixels.size(), drawn.pixels.size());
    Image difference(kWidth, kHeight, {});
    std::size_t off = 0;
    for (std::size_t k = 0; k < drawn.pixels.size(); ++k) {
      const int d = distance(drawn.pixels[k], expected.pixels[k]);
      off += d > 12;
      difference.pixels[k] = {std::uint8_t(d), std::uint8_t(d), std::uint8_t(d)};
    }
    const double part = double(off) / double(drawn.pixels.size());
    EXPECT_LT(part, 0.01) << name;
    std::size_t unlike = 0;  // the control: a picture moved by four pixels is another one
    for (std::size_t k = 4; k < drawn.pixels.size(); ++k)
      unlike += distance(drawn.pixels[k], expected.pixels[k - 4]) > 12;
    EXPECT_GT(double(unlike) / double(drawn.pixels.size()), 0.02) << name;
    if (part < 0.01) return;
    write_png(name + ".drawn.png", drawn), write_png(name + ".difference.png", difference);
  }

  static Scene scene() {
    Scene s;
    s.width = kWidth, s.height = kHeight;
    s.camera = Viewpoint{{740600, 4053400, 1500}, {744600, 4057600, 450}, 50};
    s.effects.sun = effects::Sun{};
    return s;
  }

  GridFolder folder_;
};

TEST_F(PicturesTest, Plain) {
  Scene s = scene();
  s.effects.sun.reset();
  expect_picture(s, "plain");
}

TEST_F(PicturesTest, EveningWithShadowsAndHaze) {
  Scene s = scene();
  s.background = {0x8f, 0xb0, 0xd8};
  s.effects.sun = effects::Sun{.azimuth = 285, .elevation = 10, .strength = 1.3, .color = {0xff, 0xd9, 0xb0}};
  s.effects.shadow = effects::Shadow{}, s.effects.sky = effects::Sky{}, s.effects.tints = effects::Tints{};
  s.effects.haze = effects::Haze{.visibility = 30000, .color = {0xd8, 0xc8, 0xbc}};
  expect_picture(s, "evening");
}

TEST_F(PicturesTest, Flood) {
  Scene s = scene();
  s.effects.water = effects::Water{.level = 620, .clarity = 10};
  s.effects.tints = effects::Tints{}, s.effects.sky = effects::Sky{};
  s.effects.haze = effects::Haze{.visibility = 60000};
  expect_picture(s, "flood");
}

TEST_F(PicturesTest, ErrorMap) {
  insert_survey();
  Scene s = scene();
  s.pixel_error = 2;
  s.effects.error = effects::ErrorOverlay{};
  expect_picture(s, "error");
}

TEST_F(PicturesTest, SurveyInserted) {
  insert_survey();
  Scene s = scene();
  s.effects.source = effects::SourceOverlay{}, s.effects.contours = effects::Contours{.interval = 20};
  expect_picture(s, "survey");
}

}  // namespace
}  // namespace patchwork
