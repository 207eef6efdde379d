// Colours as numbers, ramps along which equal steps look equal, and scales that put values on them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "render/picture.h"

namespace patchwork {

/// Bjorn Ottosson, "A perceptual color space for image processing" (2020): lightness 0 to 1, green to red,
/// blue to yellow.
struct Oklab {
  double l = 0, a = 0, b = 0;
};
Oklab oklab_of(Color c);
/// Clamped to what sRGB can show.
Color color_of(const Oklab& c);
Oklab mix(const Oklab& p, const Oklab& q, double t);

/// sRGB's transfer function, IEC 61966-2-1: 0..255 to linear light 0..1 and back, rounded and clamped.
double linear_of(std::uint8_t coded);
std::uint8_t srgb_coded(double linear);

/// Colours from 0 to 1, mixed in Oklab between stops at equal distances.
class ColorRamp {
 public:
  explicit ColorRamp(std::span<const Color> stops);
  Oklab oklab(double t) const;  ///< t is clamped to [0, 1]
  Color at(double t) const { return color_of(oklab(t)); }
  /// `n` colours from 0 to 1, for a texture.
  std::vector<Color> table(int n) const;

 private:
  std::vector<Oklab> stops_;
};

enum class RampName { land, viridis, cividis, grey };
/// land: hypsometric tints from meadow to snow, lightness rising by the same step from tint to tint. viridis:
/// Smith and van der Walt (2015, CC0). cividis: Nunez, Anderton and Renslow (2018), alike to colour-blind
/// eyes.
const ColorRamp& color_ramp(RampName name);

/// A colour of its own for each of the first eight classes (Okabe and Ito's, most unlike first), grey for the
/// rest.
inline constexpr std::size_t kClassColors = 8;
Color class_color(std::size_t k);

/// Which part of a ramp a value gets.
struct ValueScale {
  double lowest = 0, highest = 1;
  bool logarithmic = false;  ///< REQUIRES then: lowest > 0

  double part(double value) const;  ///< in [0, 1]
  /// Round values on the scale: four to ten.
  std::vector<double> ticks() const;
};

/// (mean of cubes) / (mean of squares)^1.5 about the mean, of what is finite; 0 for equal values.
double skewness(std::span<const float> values);

/// From the lowest to the highest finite value; logarithmic where the values' skewness is above 1 and the
/// lowest above 0. Pictures that are compared share one scale.
ValueScale scale_of(std::span<const float> values);

/// "1200", "0.25": six digits at most, no zeros behind.
std::string number_text(double value);

}  // namespace patchwork
