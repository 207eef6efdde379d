// Effects in pictures: against the reference's formulas, what each makes anew, and what it leaves alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>
#include <set>

#include "render/effects/relief.h"
#include "render/renderer.h"
#include "render/tile_seams.h"
#include "tests/blend/vulkan_scene.h"
#include "tests/render/shade_reference.h"

namespace patchwork {
namespace {

using effects::Id;

constexpr int kWidth = 256, kHeight = 144;
const Camera kCamera{{150, 120, 520}, {900, 900, 300}, 60, kWidth, kHeight};

Renderer renderer_of(const Database& db, const SceneEffects& e, double pixel_error = 0.25,
                     std::optional<Tessellation> way = {}) {
  return {test_device(),
          db,
          {.width = kWidth,
           .height = kHeight,
           .pixel_error = pixel_error,
           .memory = std::size_t{256} << 20,
           .tessellation = way,
           .effects = e,
           .legend = false}};
}

SceneEffects lit(double azimuth, double elevation) {
  SceneEffects e;
  e.sun = effects::Sun{.azimuth = azimuth, .elevation = elevation};
  return e;
}

int distance(Color a, Color b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

int most_difference(const Image& a, const Image& b) {
  int most = 0;
  for (std::size_t k = 0; k < a.pixels.size(); ++k) most = std::max(most, distance(a.pixels[k], b.pixels[k]));
  return most;
}

class EffectsTest : public VulkanTest {
 protected:
  static void SetUpTestSuite() { land_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static Image picture(const SceneEffects& e) {
    Renderer r = renderer_of(db(), e);
    r.draw(kCamera);
    return r.picture();
  }
  static std::unique_ptr<Land> land_;
};
std::unique_ptr<Land> EffectsTest::land_;

// The light map by the reference's horizons: bilinear between samples.
class MapReference {
 public:
  MapReference(const effects::Relief& relief, const Scene& scene) : relief_(relief), scene_(scene) {}
  double toward_sun(double i, double j) const {
    const double azimuth = scene_.effects.sun->azimuth * kDegree;
    return between(i, j, 1,
                   [&](int a, int b) { return std::clamp(relief_.horizon(a, b, azimuth), -1.0, 1e4); });
  }
  double open(double i, double j) const {
    const int k = scene_.effects.sky->directions;
    ShadeReference formulas;
    return between(i, j, 4, [&](int a, int b) {
      int sees = 0;
      for (int n = 0; n < k; ++n) {
        const glm::dvec3 d = formulas.sky_direction(n, k);
        sees += relief_.horizon(a, b, std::atan2(d.x, d.y)) < d.z;
      }
      return double(sees) / k;
    });
  }

 private:
  template <class At>
  double between(double i, double j, int stride, const At& at) const {
    const auto clamped = [&](int a, int side) { return std::clamp(a, 0, (side - 1) / stride); };
    const double x = i / stride, y = j / stride;
    const int ci = int(std::floor(x)), cj = int(std::floor(y));
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const int a = ci + k % 2, b = cj + k / 2;
      const double w = (k % 2 ? x - ci : 1 - x + ci) * (k / 2 ? y - cj : 1 - y + cj);
      sum += w * at(clamped(a, relief_.width()) * stride, clamped(b, relief_.height()) * stride);
    }
    return sum;
  }
  const effects::Relief& relief_;
  const Scene& scene_;
};

// The part of pixels that differ from the reference by more than 8 of 255. What it knows of the ground comes
// from the blend; where the pixel is, from the picture's depth.
double part_off(const Database& db, const SceneEffects& e) {
  Renderer r = renderer_of(db, e);
  r.draw(kCamera);
  const Image image = r.picture();
  const std::vector<float> depth = r.depth();
  const Extraction x = extract(db, {.error = 0});
  const Blend best(db, x.patches, {.smoothness = 1});
  Scene scene;
  scene.effects = e;
  const ViewCut all = over_terrain_of(db, {.eye = kCamera.eye, .look = kCamera.look});
  const Extent extent = db.extent();
  // As LightMap takes it: 2.5 m is the finest step.
  const int side = int(std::max(extent.xmax - extent.xmin, extent.ymax - extent.ymin) / 2.5) + 1;
  const effects::Relief relief = effects::Relief::of(best, extent, side);
  effects::SceneView view{kCamera, all.lowest, all.highest, all.far, 100};
  const effects::Set on = effects::called_for(scene, view);
  ShadeReference shader = reference_of(scene, {view, {all.lowest, all.highest, false}, {}}, on);
  const MapReference map(relief, scene);
  std::size_t off = 0, pixels = 0;
  for (int row = 1; row < kHeight; row += 3)
    for (int column = 1; column < kWidth; column += 3) {
      const std::size_t k = std::size_t(row * kWidth + column);
      if (std::isnan(depth[k])) continue;
      const glm::dvec3 p = ray(kCamera, column, row).at(double(depth[k]));
      Points points;
      for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}})
        points.add(p.x + 0.5 * dx, p.y + 0.5 * dy);
      Answers a(points.size());
      best.at_points(points.x, points.y, a.out());
      if (std::count(a.source.begin(), a.source.end(), 0)) continue;
      ShadeReference::Ground g{};
      g.from_eye = p - vec(kCamera.eye), g.z = a.height[0];
      g.normal = glm::normalize(glm::dvec3(a.height[2] - a.height[1], a.height[4] - a.height[3], 1));
      const double i = (p.x - extent.xmin) / relief.step(), j = (p.y - extent.ymin) / relief.step();
      if (e.shadow) g.horizon = map.toward_sun(i, j);
      g.open = e.sky ? map.open(i, j) : 1;
      const glm::dvec3 c = shader.srgb(shader.shade_ground(g));
      const auto coded = [](double v) { return std::uint8_t(std::lround(255 * v)); };
      ++pixels;
      off += distance(image.pixels[k], {coded(c.x), coded(c.y), coded(c.z)}) > 8;
    }
  EXPECT_GT(pixels, 1000u);
  return double(off) / double(pixels);
}

TEST_F(EffectsTest, PixelsAreThoseOfTheReference) {
  SceneEffects sun = lit(120, 25);
  EXPECT_LT(part_off(db(), sun), 0.02) << "sun";
  SceneEffects colours = sun;
  colours.tints = effects::Tints{}, colours.haze = effects::Haze{.visibility = 3000};
  EXPECT_LT(part_off(db(), colours), 0.02) << "tints and haze";
  SceneEffects water = sun;
  water.water = effects::Water{.level = 290, .waves = 0};
  EXPECT_LT(part_off(db(), water), 0.03) << "water";
  water.sun.reset();
  EXPECT_LT(part_off(db(), water), 0.03) << "water alone: dry tiles are those of the same picture";
  SceneEffects shadow = lit(120, 12);
  shadow.shadow = effects::Shadow{.softness = 3};
  EXPECT_LT(part_off(db(), shadow), 0.03) << "shadow";
  SceneEffects sky = lit(120, 40);
  sky.sky = effects::Sky{};
  EXPECT_LT(part_off(db(), sky), 0.03) << "sky";
}

// The control: the same comparison sees an effect that is missing from the picture.
TEST_F(EffectsTest, EveryEffectShows) {
  const SceneEffects low = lit(120, 12);
  const Image bare = picture(low);
  const auto changes = [&](auto&& add) {
    SceneEffects e = low;
    add(e);
    return most_difference(picture(e), bare);
  };
  EXPECT_GT(changes([](SceneEffects& e) { e.shadow = effects::Shadow{}; }), 20) << "shadow";
  EXPECT_GT(changes([](SceneEffects& e) { e.sky = effects::Sky{}; }), 4) << "sky";
  EXPECT_GT(changes([](SceneEffects& e) { e.water = effects::Water{.level = 290}; }), 40) << "water";
  EXPECT_GT(changes([](SceneEffects& e) { e.haze = effects::Haze{.visibility = 3000}; }), 40) << "haze";
  EXPECT_GT(changes([](SceneEffects& e) { e.tints = effects::Tints{}; }), 20) << "tints";
  EXPECT_GT(changes([](SceneEffects& e) { e.contours = effects::Contours{.interval = 20}; }), 40)
      << "contours";
  EXPECT_GT(changes([](SceneEffects& e) { e.error = effects::ErrorOverlay{}; }), 20) << "error";
  EXPECT_GT(changes([](SceneEffects& e) { e.source = effects::SourceOverlay{}; }), 20) << "source";
  EXPECT_GT(changes([](SceneEffects& e) { e.cost = effects::CostOverlay{}; }), 20) << "cost";
  EXPECT_GT(changes([](SceneEffects& e) { e.wireframe = effects::Wireframe{}; }), 20) << "wireframe";
  EXPECT_GT(changes([](SceneEffects& e) { e.curvature = effects::Curvature{.radius = 20000}; }), 20)
      << "curvature";
}

TEST_F(EffectsTest, TheSunStandsInTheSky) {
  SceneEffects e = lit(45, 4);
  e.solar_disc = effects::SolarDisc{.diameter = 3};
  Camera camera = kCamera;
  camera.look = {camera.eye.x + 1000, camera.eye.y + 1000, camera.eye.z};
  Renderer r = renderer_of(db(), e);
  r.draw(camera);
  const Seen sun = see(camera, point(vec(camera.eye) + 1e6 * effects::direction_of(*e.sun)));
  EXPECT_EQ(r.picture().at(int(sun.x), int(sun.y)), (Color{0xff, 0xff, 0xff}));
}

// Scene gates: what cannot change a pixel is not called for, and does not.
TEST_F(EffectsTest, WhatIsNotPossibleCostsNothingAndChangesNothing) {
  SceneEffects high = lit(120, 89), with = high;
  with.shadow = effects::Shadow{}, with.water = effects::Water{.level = -100};
  with.contours = effects::Contours{.interval = 100000};
  Renderer r = renderer_of(db(), with);
  const FrameStats stats = r.draw(kCamera);
  EXPECT_EQ(stats.shadow_dispatches, 0u);
  EXPECT_EQ(most_difference(r.picture(), picture(high)), 0);
}

// The counter table: what a step of the camera, of the sun, a survey, and nothing make anew.
class CountersTest : public VulkanTest {
 protected:
  CountersTest() {
    Database writer = folder_.database();
    folder_.add(writer, surveys()[0], "base");
  }
  GridFolder folder_;
};

TEST_F(CountersTest, EachChangeMakesAnewWhatRestsOnIt) {
  Database db = folder_.database();
  SceneEffects e = lit(120, 12);
  e.shadow = effects::Shadow{}, e.sky = effects::Sky{}, e.haze = effects::Haze{};
  Renderer r = renderer_of(db, e, 1);
  struct Row {
    std::size_t tiles, shadow, sky, draws;
    bool operator==(const Row&) const = default;
  };
  const auto row = [&](const Camera& camera) {
    const FrameStats s = r.draw(camera);
    return Row{std::min<std::size_t>(s.tiles_made, 1), s.shadow_dispatches, s.sky_dispatches,
               std::min<std::size_t>(s.draws, 1)};
  };
  EXPECT_EQ(row(kCamera), (Row{1, 1, 1, 1})) << "the first picture";
  EXPECT_EQ(row(kCamera), (Row{0, 0, 0, 0})) << "nothing";
  Camera moved = kCamera;
  moved.eye.x += 0.5;
  EXPECT_EQ(row(moved), (Row{0, 0, 0, 1})) << "camera";
  e.sun->azimuth = 130;
  r.change(e);
  EXPECT_EQ(row(moved), (Row{0, 1, 0, 1})) << "sun";
  e.haze->visibility = 1000;
  r.change(e);
  EXPECT_EQ(row(moved), (Row{0, 0, 0, 1})) << "haze";
  {
    Database writer = folder_.database();
    folder_.add(writer, surveys()[1], "survey");
  }
  EXPECT_TRUE(r.refresh(db));
  EXPECT_EQ(row(moved), (Row{1, 1, 1, 1})) << "insertion";
  EXPECT_EQ(row(moved), (Row{0, 0, 0, 0})) << "nothing";
}

// Tiles of the same effects are drawn together: only those that reach below the level are wet.
TEST_F(CountersTest, ATileIsShadedByWhatCanMatterToIt) {
  const Database db = folder_.database();
  for (const Tessellation way : {Tessellation::hardware, Tessellation::mesh}) {
    SceneEffects e = lit(120, 12);
    const auto wet = [&](const Renderer& r) {
      std::size_t n = 0;
      for (const TileDraw& d : r.drawn().draws) n += has(effects::Set(d.effects), Id::water);
      return n;
    };
    Renderer dry = renderer_of(db, e, 1, way);
    const FrameStats plain = dry.draw(kCamera);
    EXPECT_EQ(wet(dry), 0u);
    const GridInfo& land = db.grids()[0].info;
    std::size_t before = 0;
    for (const double share : {0.01, 0.3, 1.0}) {
      e.water = effects::Water{.level = land.lowest + share * (land.highest - land.lowest)};
      Renderer r = renderer_of(db, e, 1, way);
      const FrameStats stats = r.draw(kCamera);
      EXPECT_EQ(stats.triangles, plain.triangles) << "each tile is drawn once";
      EXPECT_GE(wet(r), before);
      if (share < 1) {
        EXPECT_LT(wet(r), stats.tiles_drawn);
      }
      if (way == Tessellation::mesh) {
        std::set<std::pair<std::uint32_t, std::uint32_t>> alike;
        for (const TileDraw& d : r.drawn().draws) alike.emplace(d.holes, d.effects);
        EXPECT_EQ(stats.draws, alike.size()) << share;
        EXPECT_LE(alike.size(), share < 1 ? 4u : 2u) << "with and without holes";
      }
      before = wet(r);
    }
    EXPECT_EQ(before, plain.tiles_drawn) << "all of it may be under water";
  }
}

// Light comes in slices while a camera flies: a bounded part a frame, full light until then.
TEST_F(CountersTest, LightOfAFlightComesInSlicesAndEndsAsTheSamePicture) {
  {
    Database writer = folder_.database();
    folder_.add(writer, surveys()[1], "fine");  // 226 x 200 samples
  }
  const Database db = folder_.database();
  SceneEffects e = lit(120, 12);
  Renderer plain = renderer_of(db, e, 1);
  e.shadow = effects::Shadow{}, e.sky = effects::Sky{};
  Renderer waits = renderer_of(db, e, 1);
  const FrameStats whole = waits.draw(kCamera);
  EXPECT_EQ(whole.light_left, 0u);
  EXPECT_EQ(whole.shadow_dispatches, 1u);
  Renderer flies(test_device(), db,
                 {.width = kWidth,
                  .height = kHeight,
                  .memory = std::size_t{256} << 20,
                  .realtime = true,
                  .effects = e,
                  .legend = false});
  FrameStats s = flies.draw(kCamera);
  EXPECT_GT(s.light_left, 0u);
  std::size_t texels = s.light_texels, frames = 1;
  for (; frames < 5000 && (s.tiles_wanted > 0 || s.light_left > 0); ++frames) {
    s = flies.draw(kCamera);
    texels += s.light_texels;
    ASSERT_LT(s.light_texels, whole.light_texels / 4);
  }
  EXPECT_EQ(texels, whole.light_texels) << "each is made once";
  EXPECT_GT(frames, 5u);
  EXPECT_EQ(most_difference(flies.picture(), waits.picture()), 0);
  plain.draw(kCamera);
  EXPECT_GT(most_difference(plain.picture(), waits.picture()), 20) << "the control";
  EXPECT_EQ(flies.draw(kCamera).draws, 0u) << "nothing is left to do";
}

TEST_F(CountersTest, ASurveyMakesTheLightAnewThatItReachesAndNoOther) {
  {
    Database writer = folder_.database();
    folder_.add(writer, surveys()[1], "fine");
  }
  Database db = folder_.database();
  SceneEffects e = lit(120, 12);
  e.shadow = effects::Shadow{}, e.sky = effects::Sky{};
  Renderer r = renderer_of(db, e, 1);
  const FrameStats first = r.draw(kCamera);
  {
    Database writer = folder_.database();
    const GridFile small =
        survey({.width = 30, .height = 30, .geotransform = rotated(500, 700, 10, 8, 8)}, 0.05);
    folder_.add(writer, small, "small");
  }
  EXPECT_TRUE(r.refresh(db));
  const FrameStats second = r.draw(kCamera);
  EXPECT_GT(second.shadow_dispatches, 0u);
  EXPECT_GT(second.light_texels, 0u);
  EXPECT_LT(second.light_texels, first.light_texels / 2);
  const Image part = r.picture();
  // All of it made anew is the same light.
  SceneEffects other = e;
  other.sun->azimuth = 300, other.sky->directions = 4;
  r.change(other);
  r.draw(kCamera);
  EXPECT_GT(most_difference(r.picture(), part), 20) << "the control";
  r.change(e);
  EXPECT_EQ(r.draw(kCamera).light_texels, first.light_texels);
  EXPECT_EQ(most_difference(r.picture(), part), 0);
}

TEST_F(CountersTest, AnOverlayThatSlotsDoNotKnowIsRefused) {
  const Database db = folder_.database();
  Renderer r = renderer_of(db, lit(120, 30), 1);
  SceneEffects e = lit(120, 30);
  e.error = effects::ErrorOverlay{};
  EXPECT_NE(refusal_of([&] { r.change(e); }).find("without overlays"), std::string::npos);
}

TEST_F(CountersTest, TheLegendIsDrawnWhereThereIsAScale) {
  const Database db = folder_.database();
  SceneEffects e = lit(120, 30);
  e.source = effects::SourceOverlay{};
  Renderer plain = renderer_of(db, e, 1);
  plain.draw(kCamera);
  Renderer with(test_device(), db,
                {.width = kWidth, .height = kHeight, .memory = std::size_t{256} << 20, .effects = e});
  with.draw(kCamera);
  const Image a = plain.picture(), b = with.picture();
  EXPECT_EQ(a.at(0, 0), b.at(0, 0));
  EXPECT_GT(distance(a.at(kWidth - 16, kHeight - 16), b.at(kWidth - 16, kHeight - 16)), 4);
}

// A film whose colours meant another bound in each picture could not be read.
TEST_F(CountersTest, AScaleThatIsKeptIsThatOfAllPictures) {
  const Database db = folder_.database();
  SceneEffects e = lit(120, 30);
  e.error = effects::ErrorOverlay{};
  Renderer r = renderer_of(db, e, 8);
  Camera far = kCamera;
  far.eye.z = 6000;
  r.draw(far);
  const ValueScale other = r.overlay_scale();
  r.draw(kCamera);
  const ValueScale first = r.overlay_scale();
  ASSERT_TRUE(first.lowest != other.lowest || first.highest != other.highest) << "the control";
  r.keep_scale();
  r.draw(far);
  EXPECT_EQ(r.overlay_scale().lowest, first.lowest);
  EXPECT_EQ(r.overlay_scale().highest, first.highest);
  EXPECT_EQ(r.overlay_scale().logarithmic, first.logarithmic);
  r.change(e);
  r.draw(far);
  EXPECT_EQ(r.overlay_scale().highest, other.highest);
}

}  // namespace
}  // namespace patchwork
