#include "render/hillshade.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>
#include <vector>

#include "db/error.h"
#include "render/color.h"
#include "render/legend.h"

namespace patchwork {
namespace {

constexpr int kMargin = 24, kLegendWidth = 132, kCaption = 46, kTitle = 34;
// Between half of the first and the second the samples are the pixels: a resize by a factor near 1 only
// blurs.
constexpr int kEnlargeTo = 1000, kLargest = 1150, kMostEnlargement = 40, kRampHeight = 320;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Row-major; reading beyond the border gives the border.
struct Heights {
  int width, height;
  std::vector<float> z;
  float at(int x, int y) const {
    return z[size_t(std::clamp(y, 0, height - 1)) * size_t(width) + size_t(std::clamp(x, 0, width - 1))];
  }
};

// ---- size: area mean downwards, Catmull-Rom upwards

// Samples [first, first + weights.size()) of the input make one output sample.
struct Tap {
  int first;
  std::vector<double> weights;
};

// Every input sample by the part of it that lies in [from, to): whole samples alone would beat against the
// lattice.
Tap area_tap(double from, double to, int size) {
  Tap tap{int(from), {}};
  for (int i = tap.first; i < size && i < to; ++i)
    tap.weights.push_back(std::min(to, i + 1.0) - std::max(from, double(i)));
  return tap;
}

// Smooth slopes between samples: bilinear interpolation shows its cells as facets once it is shaded.
Tap cubic_tap(double centre) {
  const double base = std::floor(centre), t = centre - base;
  return {int(base) - 1,
          {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (1.5 * t - 2.5), t * (0.5 + t * (2 - 1.5 * t)),
           t * t * (0.5 * t - 0.5)}};
}

std::vector<Tap> taps(int from, int to) {
  const double ratio = double(from) / to;
  std::vector<Tap> all;
  for (int i = 0; i < to; ++i)
    all.push_back(ratio > 1 ? area_tap(i * ratio, (i + 1) * ratio, from)
                            : cubic_tap((i + 0.5) * ratio - 0.5));
  return all;
}

// The weighted mean of what is there; none where the input under the pixel's middle is missing, so that gaps
// keep their outline.
float filtered(const Heights& in, const Tap& across, const Tap& down, int x, int y) {
  if (std::isnan(in.at(x, y))) return kNone;
  double sum = 0, weight = 0;
  bool gaps = false;
  for (size_t r = 0; r < down.weights.size(); ++r)
    for (size_t c = 0; c < across.weights.size(); ++c) {
      const float z = in.at(across.first + int(c), down.first + int(r));
      const double w = across.weights[c] * down.weights[r];
      if (std::isnan(z))
        gaps = true;
      else
        sum += w * z, weight += w;
    }
  // Next to a gap the cubic's negative weights may be most of what is left.
  return gaps && weight < 0.25 ? in.at(x, y) : float(sum / weight);
}

Heights resized(Heights&& in) {
  const int width = in.width, height = in.height;
  const int longest = std::max(width, height);
  if (longest > kEnlargeTo / 2 && longest <= kLargest) return std::move(in);
  const double factor =
      std::min(double(kMostEnlargement), double(longest > kLargest ? kLargest : kEnlargeTo) / longest);
  Heights out{
      std::max(1, int(std::lround(width * factor))), std::max(1, int(std::lround(height * factor))), {}};
  const std::vector<Tap> across = taps(width, out.width), down = taps(height, out.height);
  out.z.reserve(size_t(out.width) * size_t(out.height));
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      out.z.push_back(filtered(in, across[size_t(x)], down[size_t(y)], int((x + 0.5) * width / out.width),
                               int((y + 0.5) * height / out.height)));
  return out;
}

// ---- shade

struct Slope {
  double east, south;  // metres per metre
};

// Horn's 3 x 3 gradient; a missing neighbour counts as level ground.
Slope slope_at(const Heights& h, int x, int y, double step) {
  const auto z = [&](int dx, int dy) {
    const float v = h.at(x + dx, y + dy);
    return double(std::isnan(v) ? h.at(x, y) : v);
  };
  const double east = z(1, -1) + 2 * z(1, 0) + z(1, 1) - z(-1, -1) - 2 * z(-1, 0) - z(-1, 1);
  const double south = z(-1, 1) + 2 * z(0, 1) + z(1, 1) - z(-1, -1) - 2 * z(0, -1) - z(1, -1);
  return {east / (8 * step), south / (8 * step)};
}

// Light from the north-west, softened from the west and the north so that ridges along it do not vanish; 0 on
// level ground, negative in shadow.
double shade(const Slope& s, double exaggeration) {
  const double e = s.east * exaggeration, n = -s.south * exaggeration;
  const double up = 1 / std::sqrt(1 + e * e + n * n), c = std::sqrt(0.5);
  const auto lit = [&](double to_east, double to_north) {
    return std::max(0.0, c * up * (1 - to_east * e - to_north * n)) - c;
  };
  return 0.6 * lit(-c, c) + 0.2 * lit(-1, 0) + 0.2 * lit(0, 1);
}

// Chroma goes with lightness into the shadow, where a tint kept whole would turn garish.
Oklab shaded(const Oklab& c, double s) {
  const double l = c.l + (s < 0 ? 0.75 : 0.45) * s, kept = std::clamp(l / c.l, 0.0, 1.0);
  return {l, c.a * kept, c.b * kept};
}

// Steep ground (the 90th of 100 slopes) is shown at 40 degrees, whatever the relief.
double exaggeration_for(const std::vector<Slope>& slopes, const Heights& h) {
  std::vector<double> steepness;
  for (size_t k = 0; k < slopes.size(); ++k)
    if (!std::isnan(h.z[k])) steepness.push_back(std::hypot(slopes[k].east, slopes[k].south));
  if (steepness.empty()) return 1;
  const auto steep = steepness.begin() + std::ptrdiff_t(steepness.size() * 9 / 10);
  std::nth_element(steepness.begin(), steep, steepness.end());
  return *steep > 0 ? 0.84 / *steep : 1;
}

// Of the heights given, not of those shown: averaging would understate the summits.
struct Range {
  float low = kNone, high = kNone;
  bool gaps = false;
  ValueScale scale() const { return {low, high, false}; }
};

Range range_of(std::span<const float> heights) {
  Range r;
  for (float z : heights) {
    if (std::isnan(z))
      r.gaps = true;
    else
      r.low = std::fmin(r.low, z), r.high = std::fmax(r.high, z);
  }
  return r;
}

Image relief(const Heights& h, const Range& range, double step, double& exaggeration) {
  std::vector<Slope> slopes;
  slopes.reserve(h.z.size());
  for (int y = 0; y < h.height; ++y)
    for (int x = 0; x < h.width; ++x) slopes.push_back(slope_at(h, x, y, step));
  exaggeration = exaggeration_for(slopes, h);
  Image image(h.width, h.height, {});
  for (int y = 0; y < h.height; ++y)
    for (int x = 0; x < h.width; ++x) {
      const float z = h.at(x, y);
      if (std::isnan(z)) {
        image.at(x, y) = hatch_color(x, y);
        continue;
      }
      const double s = shade(slopes[size_t(y) * size_t(h.width) + size_t(x)], exaggeration);
      image.at(x, y) = color_of(shaded(color_ramp(RampName::land).oklab(range.scale().part(z)), s));
    }
  return image;
}

// ---- legend

void draw_legend(Canvas& canvas, int x, int top, int map_height, const Range& range) {
  if (!std::isnan(range.low)) {
    const RampLegend legend{"Height, m", &color_ramp(RampName::land), range.scale()};
    canvas.text(x, top + 13, legend.title, {.bold = true});
    const int ramp = std::min(kRampHeight, map_height - 70);
    draw_ramp(canvas, x, top + 28, ramp, legend);
    top += ramp + 44;
  }
  if (!range.gaps) return;
  Image swatch(26, 16, {});
  for (int r = 0; r < swatch.height; ++r)
    for (int c = 0; c < swatch.width; ++c) swatch.at(c, r) = hatch_color(c, r);
  canvas.picture(x, top, swatch);
  canvas.text(x + 34, top + 13, "no data", {.size = 13});
}

}  // namespace

Image hillshade(std::span<const float> heights, int width, int height, double step_metres,
                const std::string& title) {
  if (width < 1 || height < 1 || heights.size() != size_t(width) * size_t(height))
    throw Error("hillshade", "the heights are not width x height samples");
  if (!(step_metres > 0) || !std::isfinite(step_metres)) throw Error("hillshade", "the step is not above 0");
  Heights given{width, height, {heights.begin(), heights.end()}};
  for (float& z : given.z)
    if (!std::isfinite(z)) z = kNone;
  const Range range = range_of(given.z);
  const Heights shown = resized(std::move(given));
  const double step = step_metres * width / shown.width;
  double exaggeration = 1;
  const Image map = relief(shown, range, step, exaggeration);

  const int top = kMargin + (title.empty() ? 0 : kTitle);
  // The legend and the caption have their own least sizes, however small the map is.
  const int body_width = std::max(map.width, 560), body_height = std::max(map.height, 240);
  Canvas canvas(body_width + kLegendWidth + 2 * kMargin + 16, top + body_height + kCaption + kMargin / 2,
                {0xff, 0xff, 0xff});
  if (!title.empty())
    canvas.text(kMargin, kMargin + 14, canvas.fitted(title, body_width, {.size = 18, .bold = true}),
                {.size = 18, .bold = true});
  canvas.picture(kMargin, top, map);
  canvas.frame_rect(kMargin - 1, top - 1, map.width + 2, map.height + 2, 1, {0x88, 0x88, 0x88});
  draw_legend(canvas, kMargin + body_width + 20, top, body_height, range);
  const double caption = top + body_height + 26;
  draw_scale_bar(canvas, kMargin, caption, step, 180);
  char text[128];
  if (std::isnan(range.low))
    std::snprintf(text, sizeof text, "no heights here");
  else
    std::snprintf(text, sizeof text, "%.1f to %.1f m, north up, light from north-west, relief × %.2g",
                  range.low, range.high, exaggeration);
  canvas.text(kMargin + body_width, caption + 5, text, {.size = 13, .align = Align::right});
  return canvas.image();
}

}  // namespace patchwork
