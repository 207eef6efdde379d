#include "render/color.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>

namespace patchwork {

double linear_of(std::uint8_t v) {
  const double c = v / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

std::uint8_t srgb_coded(double c) {
  c = std::clamp(c, 0.0, 1.0);
  return std::uint8_t(std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
}

Oklab oklab_of(Color c) {
  const double r = linear_of(c.r), g = linear_of(c.g), b = linear_of(c.b);
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

Color color_of(const Oklab& c) {
  const auto cube = [](double v) { return v * v * v; };
  const double l = cube(c.l + 0.3963377774 * c.a + 0.2158037573 * c.b);
  const double m = cube(c.l - 0.1055613458 * c.a - 0.0638541728 * c.b);
  const double s = cube(c.l - 0.0894841775 * c.a - 1.2914855480 * c.b);
  return {srgb_coded(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          srgb_coded(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          srgb_coded(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

Oklab mix(const Oklab& p, const Oklab& q, double t) {
  return {p.l + t * (q.l - p.l), p.a + t * (q.a - p.a), p.b + t * (q.b - p.b)};
}

ColorRamp::ColorRamp(std::span<const Color> stops) {
  assert(stops.size() >= 2);
  for (const Color c : stops) stops_.push_back(oklab_of(c));
}

Oklab ColorRamp::oklab(double t) const {
  const double at = std::clamp(t, 0.0, 1.0) * double(stops_.size() - 1);
  const std::size_t k = std::min(std::size_t(at), stops_.size() - 2);
  return mix(stops_[k], stops_[k + 1], at - double(k));
}

std::vector<Color> ColorRamp::table(int n) const {
  std::vector<Color> colors;
  for (int k = 0; k < n; ++k) colors.push_back(at(n > 1 ? double(k) / (n - 1) : 0));
  return colors;
}

namespace {

// Meadow, grass, straw, ochre, rock, snow: hues of maps, at lightnesses of equal steps.
ColorRamp land() {
  const Color hues[] = {{0x76, 0xa8, 0x88}, {0xa0, 0xb9, 0x84}, {0xcf, 0xc0, 0x86},
                        {0xd9, 0xbc, 0x95}, {0xd3, 0xc3, 0xb8}, {0xf5, 0xf5, 0xf4}};
  std::array<Color, std::size(hues)> stops;
  const double first = oklab_of(hues[0]).l, last = oklab_of(hues[std::size(hues) - 1]).l;
  for (std::size_t k = 0; k < stops.size(); ++k) {
    Oklab c = oklab_of(hues[k]);
    c.l = first + (last - first) * double(k) / double(stops.size() - 1);
    stops[k] = color_of(c);
  }
  return ColorRamp(stops);
}

constexpr Color kViridis[] = {{0x44, 0x01, 0x54}, {0x47, 0x2d, 0x7b}, {0x3b, 0x52, 0x8b},
                              {0x2c, 0x72, 0x8e}, {0x21, 0x91, 0x8c}, {0x28, 0xae, 0x80},
                              {0x5e, 0xc9, 0x62}, {0xad, 0xdc, 0x30}, {0xfd, 0xe7, 0x25}};
constexpr Color kCividis[] = {{0x00, 0x22, 0x4e}, {0x12, 0x35, 0x70}, {0x3b, 0x49, 0x6c}, {0x57, 0x5d, 0x6d},
                              {0x70, 0x71, 0x73}, {0x8a, 0x87, 0x79}, {0xa5, 0x9c, 0x74}, {0xc3, 0xb3, 0x69},
                              {0xe1, 0xcc, 0x55}, {0xfe, 0xe8, 0x38}};
constexpr Color kGrey[] = {{0x20, 0x20, 0x20}, {0xf0, 0xf0, 0xf0}};

constexpr Color kClasses[] = {{0x00, 0x72, 0xb2}, {0xe6, 0x9f, 0x00}, {0x00, 0x9e, 0x73}, {0xcc, 0x79, 0xa7},
                              {0x56, 0xb4, 0xe9}, {0xd5, 0x5e, 0x00}, {0xf0, 0xe4, 0x42}, {0x4d, 0x4d, 0x4d}};
static_assert(std::size(kClasses) == kClassColors);

}  // namespace

const ColorRamp& color_ramp(RampName name) {
  static const ColorRamp ramps[] = {land(), ColorRamp(kViridis), ColorRamp(kCividis), ColorRamp(kGrey)};
  return ramps[std::size_t(name)];
}

Color class_color(std::size_t k) { return k < kClassColors ? kClasses[k] : Color{0x8c, 0x8c, 0x8c}; }

double ValueScale::part(double v) const {
  if (!(highest > lowest)) return 0.3;  // one value: neither end of the ramp
  const double p = logarithmic ? std::log(std::max(v, lowest) / lowest) / std::log(highest / lowest)
                               : (v - lowest) / (highest - lowest);
  return std::clamp(p, 0.0, 1.0);
}

std::vector<double> ValueScale::ticks() const {
  std::vector<double> t;
  if (!(highest > lowest)) return {lowest};
  if (logarithmic && highest / lowest >= 8) {
    const bool decades = highest / lowest > 2000;
    for (double power = std::pow(10, std::floor(std::log10(lowest))); power <= highest; power *= 10)
      for (const double m : {1.0, 2.0, 5.0})
        if ((m == 1 || !decades) && m * power >= lowest && m * power <= highest) t.push_back(m * power);
    return t;
  }
  const double step = round_down_125((highest - lowest) / 4);
  for (double k = std::ceil(lowest / step); k * step <= highest; ++k) t.push_back(k * step + 0.0);
  return t;
}

double skewness(std::span<const float> values) {
  double n = 0, mean = 0;
  for (const float v : values)
    if (std::isfinite(v)) mean += (double(v) - mean) / ++n;
  double squares = 0, cubes = 0;
  for (const float v : values)
    if (const double d = double(v) - mean; std::isfinite(d)) squares += d * d, cubes += d * d * d;
  return squares > 0 ? (cubes / n) / std::pow(squares / n, 1.5) : 0;
}

ValueScale scale_of(std::span<const float> values) {
  ValueScale s{INFINITY, -INFINITY, false};
  for (const float v : values)
    if (std::isfinite(v))
      s.lowest = std::min(s.lowest, double(v)), s.highest = std::max(s.highest, double(v));
  if (!(s.lowest <= s.highest)) return {0, 0, false};
  s.logarithmic = s.lowest > 0 && skewness(values) > 1;
  return s;
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value == 0 ? 0 : value);
  return text;
}

}  // namespace patchwork
