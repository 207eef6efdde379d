#include "render/color.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "render/legend.h"

namespace patchwork {
namespace {

constexpr RampName kRamps[] = {RampName::land, RampName::viridis, RampName::cividis, RampName::grey};

double difference(const Oklab& p, const Oklab& q) { return std::hypot(p.l - q.l, p.a - q.a, p.b - q.b); }

TEST(Color, SrgbComesBackFromLinearLight) {
  for (int v = 0; v < 256; ++v) EXPECT_EQ(srgb_coded(linear_of(std::uint8_t(v))), v);
  EXPECT_EQ(linear_of(255), 1);
  EXPECT_NEAR(linear_of(188), 0.5029, 1e-4);
  EXPECT_EQ(srgb_coded(-1), 0);
  EXPECT_EQ(srgb_coded(7), 255);
}

TEST(Color, OklabComesBack) {
  for (int n = 0; n < 1000; ++n) {
    const Color c{std::uint8_t(n * 7), std::uint8_t(n * 31), std::uint8_t(n * 101)};
    EXPECT_EQ(color_of(oklab_of(c)), c);
  }
  EXPECT_NEAR(oklab_of({255, 255, 255}).l, 1, 1e-6);
}

TEST(ColorRamp, LightnessRisesAllTheWay) {
  for (const RampName name : kRamps)
    for (int k = 1; k <= 100; ++k)
      EXPECT_GT(color_ramp(name).oklab(k / 100.0).l, color_ramp(name).oklab((k - 1) / 100.0).l);
}

// Steps of the ramp look alike: none is three times the mean one.
TEST(ColorRamp, EqualStepsLookAboutEqual) {
  for (const RampName name : kRamps) {
    double all = 0, most = 0;
    for (int k = 1; k <= 32; ++k) {
      const double d = difference(color_ramp(name).oklab(k / 32.0), color_ramp(name).oklab((k - 1) / 32.0));
      all += d, most = std::max(most, d);
    }
    EXPECT_LT(most, 3 * all / 32);
  }
}

TEST(ColorRamp, LandTintsAreEquallyFarApartInLightness) {
  const ColorRamp& land = color_ramp(RampName::land);
  const double step = (land.oklab(1).l - land.oklab(0).l) / 5;
  for (int k = 1; k <= 5; ++k)
    EXPECT_NEAR(land.oklab(k / 5.0).l - land.oklab((k - 1) / 5.0).l, step, 0.005);  // of 8 bits
  const Color jump[] = {{0, 0, 0}, {250, 250, 250}, {255, 255, 255}};
  EXPECT_GT(ColorRamp(jump).oklab(0.5).l, 0.9) << "the check can fail";
}

TEST(ColorRamp, EndsAreThePublishedColoursAndBeyondThemNothingChanges) {
  EXPECT_EQ(color_ramp(RampName::viridis).at(0), (Color{0x44, 0x01, 0x54}));
  EXPECT_EQ(color_ramp(RampName::viridis).at(0.5), (Color{0x21, 0x91, 0x8c}));
  EXPECT_EQ(color_ramp(RampName::viridis).at(1), (Color{0xfd, 0xe7, 0x25}));
  EXPECT_EQ(color_ramp(RampName::cividis).at(7), color_ramp(RampName::cividis).at(1));
  EXPECT_EQ(color_ramp(RampName::cividis).table(3)[1], color_ramp(RampName::cividis).at(0.5));
}

TEST(ValueScale, IsLogarithmicWhereTheValuesAreSkewed) {
  std::vector<float> even, skewed;
  for (int k = 1; k <= 1000; ++k) even.push_back(float(k)), skewed.push_back(std::exp(float(k) / 150));
  EXPECT_NEAR(skewness(even), 0, 1e-9);
  EXPECT_FALSE(scale_of(even).logarithmic);
  EXPECT_GT(skewness(skewed), 1);
  const ValueScale s = scale_of(skewed);
  EXPECT_TRUE(s.logarithmic);
  EXPECT_NEAR(s.part(std::sqrt(s.lowest * s.highest)), 0.5, 1e-9);
  skewed.push_back(0);
  EXPECT_FALSE(scale_of(skewed).logarithmic) << "there is no logarithm of 0";
  skewed.push_back(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(scale_of(skewed).lowest, 0);
}

TEST(ValueScale, ValuesBeyondItGetItsEnds) {
  for (const bool logarithmic : {false, true}) {
    const ValueScale s{1, 100, logarithmic};
    EXPECT_EQ(s.part(0), 0);
    EXPECT_EQ(s.part(1), 0);
    EXPECT_EQ(s.part(100), 1);
    EXPECT_EQ(s.part(1e9), 1);
  }
}

TEST(ValueScale, HasFourToTenRoundTicksOnIt) {
  const ValueScale scales[] = {{0, 1, false}, {-3, 411, false}, {812.3, 813.1, false}, {0.013, 870.0, true},
                               {1, 9, true},  {2, 3, true},     {1e-6, 1e3, true}};
  for (const ValueScale& s : scales) {
    const std::vector<double> ticks = s.ticks();
    EXPECT_GE(ticks.size(), 3u) << s.lowest;
    EXPECT_LE(ticks.size(), 16u) << s.lowest;
    for (const double t : ticks) EXPECT_TRUE(t >= s.lowest && t <= s.highest) << t;
  }
  EXPECT_EQ((ValueScale{0, 1000, false}.ticks()), (std::vector<double>{0, 200, 400, 600, 800, 1000}));
  EXPECT_EQ((ValueScale{5, 5, false}.ticks()), std::vector<double>{5});
  EXPECT_EQ(scale_of({}).ticks().size(), 1u);
}

TEST(Legend, CoversTheLowerRightCornerOnly) {
  Image picture(400, 300, {10, 20, 30});
  const RampLegend ramp{"Bound, m", &color_ramp(RampName::viridis), {0.1, 30, true}};
  const ClassLegend classes{"Grid", {{class_color(0), "base"}, {class_color(1), "survey"}}};
  draw_legends(picture, std::span(&ramp, 1), std::span(&classes, 1));
  EXPECT_EQ(picture.at(0, 0), (Color{10, 20, 30}));
  EXPECT_EQ(picture.at(100, 250), (Color{10, 20, 30}));
  std::size_t ramp_colors = 0, class_colors = 0;
  for (const Color c : picture.pixels)
    ramp_colors += c == color_ramp(RampName::viridis).at(84.5 / 170), class_colors += c == class_color(1);
  EXPECT_GE(ramp_colors, 20u);
  EXPECT_GE(class_colors, 200u);
}

TEST(Legend, APictureTooSmallForItStaysAsItIs) {
  Image picture(60, 40, {10, 20, 30});
  const Image before = picture;
  const RampLegend ramp{"Height, m", &color_ramp(RampName::land), {0, 1000, false}};
  draw_legends(picture, std::span(&ramp, 1), {});
  EXPECT_EQ(picture.pixels, before.pixels);
}

}  // namespace
}  // namespace patchwork
