#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "render/effects/relief.h"
#include "tests/render/shade_reference.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

using effects::Id;
using effects::LookInput;
using effects::Relief;
using effects::SceneView;
using effects::Set;
using effects::TileView;
using glm::dvec3;

// ---- horizons

// Rough ground with a few cliffs; a part `holes` of it has no data.
Relief random_relief(std::mt19937_64& random, int width, int height, double step, double holes) {
  std::uniform_real_distribution<double> any(0, 1);
  std::vector<float> z;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double hill = 40 * std::sin(i / 7.0) * std::cos(j / 5.0) + 3 * any(random);
      z.push_back(any(random) < holes ? NAN : float(any(random) < 0.01 ? hill + 60 : hill));
    }
  return Relief({1000, 2000}, step, width, height, z);
}

double bilinear(const Relief& r, double i, double j) {
  const int ci = std::clamp(int(i), 0, r.width() - 2), cj = std::clamp(int(j), 0, r.height() - 2);
  const auto at = [&](int a, int b) { return double(r.heights()[std::size_t(b * r.width() + a)]); };
  const double x = i - ci, y = j - cj;
  return (1 - y) * ((1 - x) * at(ci, cj) + x * at(ci + 1, cj)) +
         y * ((1 - x) * at(ci, cj + 1) + x * at(ci + 1, cj + 1));
}

// The same horizon by looking every 1/128 sample.
double marched(const Relief& r, double i, double j, double azimuth) {
  const double z = bilinear(r, i, j);
  double best = -1e30;
  for (double t = Relief::kFirst;; t += 1.0 / 128) {
    const double x = i + t * std::sin(azimuth), y = j + t * std::cos(azimuth);
    if (x < 0 || y < 0 || x >= r.width() - 1 || y >= r.height() - 1) return best / r.step();
    best = std::max(best, (bilinear(r, x, y) - z) / t);
  }
}

TEST(Horizon, AgreesWithMarchingEverySample) {
  std::mt19937_64 random(test_seed(1));
  std::uniform_real_distribution<double> any(0, 1);
  int seen = 0;
  for (int n = 0; n < 400; ++n) {
    const Relief r = random_relief(random, 20 + n % 50, 33, 25, n % 3 ? 0 : 0.02);
    const double i = any(random) * (r.width() - 1), j = any(random) * (r.height() - 1);
    const double azimuth = n % 5 ? any(random) * 6.28 : (n / 5 % 8) * std::numbers::pi / 4;
    const double found = r.horizon(i, j, azimuth), dense = marched(r, i, j, azimuth);
    if (bilinear(r, i, j) < -1000) continue;
    seen += dense > 0;
    EXPECT_GE(found, dense - 1e-9 * std::abs(dense)) << i << ' ' << j << ' ' << azimuth;
    if (n % 3 == 0) continue;  // the edge of a hole rises by more between two samples than can be told
    EXPECT_LE(found, dense + 0.02 * std::abs(dense) + 1e-3) << i << ' ' << j << ' ' << azimuth;
  }
  EXPECT_GT(seen, 100);
}

TEST(Horizon, OfAWallIsItsHeightOverItsDistance) {
  std::vector<float> z(40 * 40, 5.0f);
  for (int i = 0; i < 40; ++i) z[std::size_t(30 * 40 + i)] = 105;
  const Relief r({0, 0}, 10, 40, 40, z);
  EXPECT_NEAR(r.horizon(20, 10, 0), 100 / 200.0, 1e-6);
  EXPECT_NEAR(r.horizon(20, 10, std::numbers::pi), 0, 1e-9) << "level ground";
  EXPECT_LT(r.horizon(20, 39, 0), -1e20) << "nothing is there";
}

TEST(MinMaxPyramid, BlocksAreAsHighAsTheHighestSampleOfTheirCells) {
  std::mt19937_64 random(test_seed(2));
  int missed = 0;
  for (const auto& [w, h] : {std::pair{2, 2}, {3, 17}, {64, 65}, {100, 37}}) {
    const Relief r = random_relief(random, w, h, 1, 0.02);
    for (int l = 0; l <= r.top(); ++l)
      for (int j = 0; j <= (h - 2) >> l; ++j)
        for (int i = 0; i <= (w - 2) >> l; ++i) {
          float most = Relief::kLow, naive = Relief::kLow;
          for (int b = j << l; b <= std::min(h - 1, (j + 1) << l); ++b)
            for (int a = i << l; a <= std::min(w - 1, (i + 1) << l); ++a) {
              const float z = r.heights()[std::size_t(b * w + a)];
              most = std::max(most, z);
              if (a < (i + 1) << l && b < (j + 1) << l) naive = std::max(naive, z);
            }
          ASSERT_EQ(r.largest(l, i, j), most) << w << " x " << h << " level " << l << ": " << i << ", " << j;
          missed += naive < most;
        }
  }
  EXPECT_GT(missed, 0) << "negative control: without the samples that cells share with the next block";
}

TEST(Horizon, SteepestHoldsForEverySampleOfASquare) {
  std::mt19937_64 random(test_seed(3));
  std::uniform_real_distribution<double> any(0, 1);
  double tightest = 1e9;
  for (int n = 0; n < 20; ++n) {
    const Relief r = random_relief(random, 70, 50, 25, n % 4 ? 0 : 0.002);
    const int side = n % 2 ? 8 : 16, across = (r.width() - 2) / side + 1;
    const std::vector<float> most = r.steepest(side);
    for (int k = 0; k < 300; ++k) {
      const int i = int(any(random) * (r.width() - 1)), j = int(any(random) * (r.height() - 1));
      if (bilinear(r, i, j) < -1000) continue;
      const double seen = r.horizon(i, j, any(random) * 6.28);
      const float bound = most[std::size_t(j / side * across + i / side)];
      EXPECT_LE(seen, bound * (1 + 1e-6) + 1e-6);
      tightest = std::min(tightest, bound - seen);
    }
  }
  EXPECT_LT(tightest, 1) << "the bound is not that of everything";
}

// ---- the scene's effects

SceneView a_view() { return {{{0, 0, 500}, {1000, 2000, 300}, 60, 320, 180}, 100, 900, 20000, 0.6}; }

Scene all_effects() {
  Scene s;
  s.effects.sun = effects::Sun{}, s.effects.shadow = effects::Shadow{}, s.effects.sky = effects::Sky{};
  s.effects.water = effects::Water{.level = 300}, s.effects.haze = effects::Haze{};
  s.effects.curvature = effects::Curvature{}, s.effects.solar_disc = effects::SolarDisc{};
  s.effects.tints = effects::Tints{}, s.effects.contours = effects::Contours{};
  s.effects.wireframe = effects::Wireframe{};
  return s;
}

TEST(Registry, ASceneWithoutEffectsCallsForNone) {
  EXPECT_TRUE(effects::called_for(Scene{}, a_view()).none());
  EXPECT_TRUE(effects::matter_to(Scene{}, {}, TileView{}).none());
}

TEST(Registry, EachEffectIsCalledForByItsNameAlone) {
  const char* const texts[] = {"sun",   "shadow",   "sky",   "water",  "haze", "curvature", "solar_disc",
                               "tints", "contours", "error", "source", "cost", "wireframe"};
  for (std::size_t k = 0; k < effects::kEffects; ++k) {
    EXPECT_STREQ(effects::registry()[k].name, texts[k]);
    EXPECT_EQ(std::size_t(effects::registry()[k].id), k);
    const std::string name = texts[k];
    const std::string needs = name == "water"      ? R"({"level": 300})"
                              : name == "contours" ? R"({"interval": 9})"
                                                   : "{}";
    Scene s = parse_scene(
        R"({"effects": {"sun": {"elevation": 20, "azimuth": 27}, ")" + name + "\": " + needs + "}}", "test");
    Set expected;
    expected[std::size_t(Id::sun)] = expected[k] = true;
    EXPECT_EQ(effects::called_for(s, a_view()), expected) << name;
  }
}

TEST(Registry, AnEffectThatIsNotPossibleIsNotCalledFor) {
  const Scene s = all_effects();
  SceneView v = a_view();
  v.camera.look = {-1000, 2000, 900};  // towards the sun
  const auto called = [&](const SceneView& view, Id id) { return has(effects::called_for(s, view), id); };
  EXPECT_FALSE(called(v, Id::shadow)) << "the sun stands at 45 degrees, nothing rises above 0.6";
  v.steepest = 1.5;
  for (const Id id : {Id::shadow, Id::sky, Id::water, Id::curvature, Id::solar_disc})
    EXPECT_TRUE(called(v, id)) << int(id);
  v.steepest = 0.1;
  EXPECT_FALSE(called(v, Id::sky));
  v.lowest = 300;
  EXPECT_FALSE(called(v, Id::water));
  v.farthest = 100;
  EXPECT_FALSE(called(v, Id::curvature));
  Scene dry = s;
  dry.effects.water.reset();
  v.camera.look = {1000, -2000, 300};
  EXPECT_FALSE(has(effects::called_for(dry, v), Id::solar_disc)) << "the sun is behind the eye";
  Scene low = s;
  low.effects.sun->elevation = -1;
  v.steepest = 1.5;
  EXPECT_FALSE(has(effects::called_for(low, v), Id::shadow)) << "the sun is down";
}

TEST(Registry, SkyIsSkippedBelow358DegreesWhateverItsDirections) {
  for (const int k : {4, 16, 32})
    EXPECT_GT(effects::lowest_direction({.directions = k}), std::tan(3.58 * kDegree));
  ShadeReference r;
  EXPECT_NEAR(r.lowest_sky_direction(16), effects::lowest_direction({.directions = 16}), 1e-12);
}

// ---- tile gates: off and forced on differ by at most 1/255 where a gate says that an effect cannot matter

// Ground of a tile with such a view: heights, distance and horizons in its range.
ShadeReference::Ground random_ground(std::mt19937_64& random, const TileView& t, const Camera& c,
                                     const effects::Sky& sky) {
  std::uniform_real_distribution<double> any(0, 1);
  const auto in = [&](double low, double high) { return low + (high - low) * any(random); };
  ShadeReference::Ground g;
  g.z = in(t.lowest, t.highest);
  const double rise = g.z - c.eye.z, away = std::max(std::abs(rise), in(0.1, 1) * t.farthest),
               turn = in(0, 6.28);
  const double level = std::sqrt(std::max(0.0, away * away - rise * rise));
  g.from_eye = {level * std::cos(turn), level * std::sin(turn), rise};
  const double steep = in(0, 1) * t.steepest;
  g.normal = glm::normalize(dvec3(-steep * std::cos(3 * turn), -steep * std::sin(3 * turn), 1));
  g.change = std::exp(in(-6, 4));
  g.horizon = in(0, 1) * t.steepest;
  // The bits that such a horizon all around would take.
  int open = 0;
  for (int k = 0; k < sky.directions; ++k)
    open += ShadeReference{}.sky_direction(k, sky.directions).z > g.horizon;
  g.open = double(open) / sky.directions;
  g.value = in(0, 10);
  g.source = {any(random), any(random), any(random)};
  return g;
}

double difference(ShadeReference& a, ShadeReference& b, const ShadeReference::Ground& g) {
  const dvec3 p = a.srgb(a.shade_ground(g)), q = b.srgb(b.shade_ground(g));
  return std::max({std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)});
}

TEST(TileGate, WhatItLeavesOutChangesNoPixel) {
  std::mt19937_64 random(test_seed(4));
  std::uniform_real_distribution<double> any(0, 1);
  std::array<int, effects::kEffects> left_out{}, mattered{};
  std::array<double, effects::kEffects> most{};
  for (int n = 0; n < 4000; ++n) {
    Scene s = all_effects();
    s.effects.sun->elevation = 80 * std::pow(any(random), 3), s.effects.sun->azimuth = 360 * any(random);
    s.effects.sky->directions = 4 + n % 29;
    s.effects.haze->visibility = std::exp(3 + 11 * any(random));
    s.effects.contours->interval = std::exp(1 + 5 * any(random));
    s.effects.contours->width = 0.5 + 3 * any(random);
    s.effects.water->level = 100 + 400 * any(random);
    LookInput input{a_view(), {0, 900, false}, {0, 10, false}};
    const double low = 600 * any(random), range = std::exp(5 * any(random));
    input.view.camera.eye.z = low + range * (n % 2 ? any(random) : 10 * any(random) - 10);
    s.effects.haze->scale_height = std::exp(4 + 5 * any(random)), s.effects.haze->base = 600 * any(random);
    const double away = std::max(0.0, low - input.view.camera.eye.z) + range + std::exp(9 * any(random));
    const TileView tile{low, low + range, away, std::exp(-4 + 5 * any(random)),
                        std::min(low, input.view.camera.eye.z)};
    Set all;
    for (std::size_t k = 0; k < effects::kEffects; ++k) all[k] = k < std::size_t(Id::error);
    const Set matter = effects::matter_to(s, all, tile);
    ShadeReference forced = reference_of(s, input, all);
    for (const Id id : {Id::shadow, Id::sky, Id::water, Id::haze, Id::contours, Id::solar_disc}) {
      Set without = all;
      without[std::size_t(id)] = false;
      ShadeReference off = reference_of(s, input, without);
      for (int k = 0; k < 4; ++k) {
        const double d =
            difference(forced, off, random_ground(random, tile, input.view.camera, *s.effects.sky));
        if (has(matter, id)) {
          mattered[std::size_t(id)] += d > effects::kInvisible;
          continue;
        }
        ++left_out[std::size_t(id)];
        most[std::size_t(id)] = std::max(most[std::size_t(id)], d);
      }
    }
  }
  for (const Id id : {Id::shadow, Id::sky, Id::water, Id::haze, Id::contours, Id::solar_disc}) {
    const auto k = std::size_t(id);
    SCOPED_TRACE(effects::registry()[k].name);
    EXPECT_LE(most[k], effects::kInvisible);
    EXPECT_GT(left_out[k], 50) << "the gate is of use";
    // Few places mirror the sun; that it shows is SolarDisc's test.
    EXPECT_TRUE(mattered[k] > 50 || id == Id::solar_disc) << "the gate lets it work where it does something";
  }
}

// ---- formulas

TEST(Haze, LeavesTwoPerCentOfContrastAtItsVisibility) {
  ShadeReference r;
  const effects::Haze haze{.visibility = 30000, .base = 200};
  const double depth = r.air_depth(effects::depth_per_metre(haze, 200), 30000, 0, 1 / haze.scale_height);
  EXPECT_NEAR(r.transmittance(depth).g, 0.02, 1e-4);
}

// The closed form of the thinning air against adding up thin layers.
TEST(Haze, DepthIsTheSumOfItsLayers) {
  ShadeReference r;
  const double scale = 1 / 8000.0;
  for (const double rise : {-3000.0, -50.0, -1e-3, 0.0, 2.0, 79.0, 81.0, 5000.0}) {
    double sum = 0;
    for (int k = 0; k < 10000; ++k) sum += 1e-4 * std::exp(-rise * (k + 0.5) / 10000 * scale);
    EXPECT_NEAR(r.air_depth(1e-4, 10000, rise, scale), sum, 1e-7) << rise;
  }
}

TEST(Haze, SkyRunsIntoTheAirsColourAtTheHorizon) {
  Scene s;
  s.effects.haze = effects::Haze{};
  s.background = {0x20, 0x40, 0x90};
  const LookInput input{a_view()};
  ShadeReference r = reference_of(s, input, effects::called_for(s, input.view));
  const dvec3 air = effects::linear(s.effects.haze->color);
  EXPECT_NEAR(glm::distance(r.shade_sky({1, 0, 0}), air), 0, 1e-6);
  EXPECT_GT(glm::distance(r.shade_sky({0, 0, 1}), air), 0.05);
}

TEST(Water, LooksDeeperDarkerAndMirrorsAtGrazingAngles) {
  Scene s;
  s.effects.water = effects::Water{.level = 0, .waves = 0};
  const LookInput input{a_view()};
  ShadeReference r = reference_of(s, input, effects::called_for(s, SceneView{input.view.camera, -50}));
  ASSERT_TRUE(r.has_water);
  const auto ground = [&](double x, double z) {
    ShadeReference::Ground g{};
    g.from_eye = {x, 0, z - 500}, g.z = z, g.normal = {0, 0, 1}, g.open = 1;
    return g;
  };
  const dvec3 bed = effects::linear({0xb8, 0xb4, 0xa6}), deep = effects::linear(s.effects.water->color);
  EXPECT_NEAR(glm::distance(r.shade_ground(ground(1, -0.001)), bed), 0, 0.02);
  EXPECT_NEAR(glm::distance(r.shade_ground(ground(1, -40)), deep), 0, 0.03);
  EXPECT_NEAR(glm::distance(r.shade_ground(ground(200000, -40)), r.sky_color({1, 0, 0})), 0, 0.05);
  EXPECT_EQ(r.shade_ground(ground(1, 0.001)), bed) << "dry ground";
}

TEST(Water, WavesRepeatOverTheirPeriodAndVanishWhenFar) {
  ShadeReference r;
  const double period = r.wave_period(0.5);
  const glm::dvec2 p(12.3, 45.6), q = p + glm::dvec2(period, -2 * period);
  EXPECT_NEAR(glm::length(r.wave_slope(p, 0.5, 0.01) - r.wave_slope(q, 0.5, 0.01)), 0, 1e-12);
  EXPECT_GT(glm::length(r.wave_slope(p, 0.5, 0.01)), 1e-3);
  EXPECT_EQ(glm::length(r.wave_slope(p, 0.5, 100)), 0);
}

TEST(Contours, LinesHaveTheirWidthInPixels) {
  ShadeReference r;
  // Ground that rises 2 m a pixel: lines of 1.5 pixels every 100 m, the fifth twice as wide.
  double thin = 0, bold = 0;
  for (double z = 150; z < 250; z += 0.01) thin += 0.01 / 2 * r.contour_lines(z, 2, 100, 5, 1.5);
  for (double z = 450; z < 550; z += 0.01) bold += 0.01 / 2 * r.contour_lines(z, 2, 100, 5, 1.5);
  EXPECT_NEAR(thin, 1.5, 0.01);
  EXPECT_NEAR(bold, 3, 0.01);
  EXPECT_EQ(r.contour_lines(100, 100, 100, 5, 1), 0) << "a line a pixel is none";
}

// The height's change a pixel, against moving the ray by a hundredth of one.
TEST(Contours, ChangeIsThatOfTheTangentPlane) {
  const SceneView view = a_view();
  ShadeReference r = reference_of(Scene{}, {view}, {});
  const dvec3 n = glm::normalize(dvec3(0.2, -0.4, 1));
  const auto height = [&](double x, double y) {
    const Ray ray = ray_through(view.camera, x, y);
    return ray.direction.z * -700 / glm::dot(n, ray.direction);  // of a plane 700 m away
  };
  for (const auto& [x, y] : {std::pair{20.0, 170.0}, {160.0, 120.0}, {300.0, 179.0}}) {
    const double dx = (height(x + 0.01, y) - height(x - 0.01, y)) / 0.02;
    const double dy = (height(x, y + 0.01) - height(x, y - 0.01)) / 0.02;
    const Ray ray = ray_through(view.camera, x, y);
    const dvec3 place = ray.direction * (-700 / glm::dot(n, ray.direction));
    EXPECT_NEAR(r.height_change(place, n), std::hypot(dx, dy), 1e-3 * std::hypot(dx, dy));
  }
}

TEST(Dither, IsHalfAStepEitherWayAndNothingOnAverage) {
  ShadeReference r;
  double sum = 0;
  for (int k = 0; k < 10000; ++k) {
    const double d = r.dither(k % 100 + 0.5, k / 100 + 0.5);
    EXPECT_LE(std::abs(d), 0.5 / 255);
    sum += d;
  }
  EXPECT_NEAR(sum / 10000, 0, 0.02 / 255);
}

TEST(Shadow, FadesOverItsSoftness) {
  ShadeReference r;
  const double half = 0.5 * kDegree, tan30 = std::tan(30 * kDegree);
  EXPECT_EQ(r.sun_reach(std::tan(29.4 * kDegree), tan30, half), 1);
  EXPECT_EQ(r.sun_reach(std::tan(30.6 * kDegree), tan30, half), 0);
  EXPECT_NEAR(r.sun_reach(tan30, tan30, half), 0.5, 1e-9);
  EXPECT_EQ(r.sun_reach(std::tan(29.9 * kDegree), tan30, 0), 1);
}

TEST(Sky, DirectionsWeighTheSkyAsLevelGroundDoes) {
  ShadeReference r;
  // A horizon of angle h all around takes sin^2 h of the light, and that share of the directions.
  for (const double h : {10.0, 30.0, 60.0}) {
    int taken = 0;
    for (int k = 0; k < 32; ++k) taken += r.sky_direction(k, 32).z < std::tan(h * kDegree);
    EXPECT_NEAR(taken / 32.0, std::pow(std::sin(h * kDegree), 2), 1.5 / 32);
  }
}

TEST(SolarDisc, IsSeenWhereTheSunStands) {
  Scene s;
  s.effects.sun = effects::Sun{.azimuth = 90, .elevation = 10};
  s.effects.solar_disc = effects::SolarDisc{};
  LookInput input{a_view()};
  input.view.camera.look = {1000, 0, 500};
  ShadeReference r = reference_of(s, input, effects::called_for(s, input.view));
  ASSERT_TRUE(r.has_disc);
  const auto at = [&](double degrees) {
    return r.srgb(r.shade_sky({std::cos(degrees * kDegree), 0, std::sin(degrees * kDegree)}));
  };
  EXPECT_NEAR(glm::distance(at(10), dvec3(1)), 0, 1e-9);
  EXPECT_LT(at(10.5).b, 1);
  EXPECT_NEAR(glm::distance(at(22.01), r.srgb(effects::linear(s.background))), 0, 1e-9)
      << "the glow has an end";
}

TEST(Look, DirectionsAreTheCamerasRays) {
  const SceneView view = a_view();
  ShadeReference r = reference_of(Scene{}, {view}, {});
  for (const auto& [i, j] : {std::pair{0, 0}, {319, 179}, {160, 90}, {17, 101}})
    EXPECT_NEAR(glm::distance(r.direction_through(i + 0.5, j + 0.5), ray(view.camera, i, j).direction), 0,
                1e-12);
}

TEST(Look, BlockHoldsItsNumbersInOrder) {
  Scene s = all_effects();
  const effects::Look look = effects::look_of(s, {a_view()});
  const auto block = effects::block_of(look);
  EXPECT_EQ(block[0], float(look.sun_direction.x));
  EXPECT_EQ(block[7], float(look.sun_light.w));
  EXPECT_EQ(block[block.size() - 1], float(look.view_forward.w));
  EXPECT_EQ(block.size() % 4, 0u);
}

}  // namespace
}  // namespace patchwork
