#include "render/legend.h"

#include <algorithm>
#include <cmath>

namespace patchwork {

namespace {

constexpr double kRampWidth = 26, kTick = 5, kGap = 16, kTitle = 24, kRow = 22, kPad = 12;
constexpr double kRampHeight = 170, kMostName = 180;
constexpr Color kLine{0x66, 0x66, 0x66}, kPanel{0xfa, 0xfa, 0xf7};
constexpr TextStyle kNumber{.size = 13}, kHeading{.bold = true};

struct Size {
  double width, height;
};

Size size_of(const Canvas& canvas, const RampLegend& r) {
  double widest = 0;
  for (const double v : r.scale.ticks())
    widest = std::max(widest, canvas.text_width(number_text(v), kNumber));
  return {std::max(kRampWidth + 10 + widest, canvas.text_width(r.title, kHeading)), kTitle + kRampHeight + 6};
}

Size size_of(const Canvas& canvas, const ClassLegend& c) {
  double widest = canvas.text_width(c.title, kHeading);
  for (const auto& [color, name] : c.classes)
    widest = std::max(widest, 32 + std::min(kMostName, canvas.text_width(name, kNumber)));
  return {widest, kTitle + kRow * double(c.classes.size())};
}

void draw(Canvas& canvas, double x, double y, const RampLegend& r) {
  canvas.text(x, y + 13, r.title, kHeading);
  draw_ramp(canvas, x, y + kTitle, kRampHeight, r);
}

void draw(Canvas& canvas, double x, double y, const ClassLegend& c) {
  canvas.text(x, y + 13, c.title, kHeading);
  for (const auto& [color, name] : c.classes) {
    y += kRow;
    canvas.fill_rect(x, y, 24, 16, color);
    canvas.frame_rect(x, y, 24, 16, 1, kLine);
    canvas.text(x + 32, y + 13, canvas.fitted(name, kMostName, kNumber), kNumber);
  }
}

}  // namespace

void draw_ramp(Canvas& canvas, double x, double top, double height, const RampLegend& r) {
  for (double row = 0; row < height; ++row)
    canvas.fill_rect(x, top + row, kRampWidth, 1, r.ramp->at((height - 0.5 - row) / height));
  canvas.frame_rect(x, top, kRampWidth, height, 1, kLine);
  for (const double v : r.scale.ticks()) {
    const bool one = !(r.scale.highest > r.scale.lowest);
    const double y = top + height * (one ? 0.5 : 1 - r.scale.part(v));
    if (!one) canvas.line({x + kRampWidth, y}, {x + kRampWidth + kTick, y}, 1, kLine);
    canvas.text(x + kRampWidth + 10, y + 5, number_text(v), kNumber);
  }
}

void draw_legends(Image& picture, std::span<const RampLegend> ramps, std::span<const ClassLegend> classes) {
  Canvas canvas(picture.width, picture.height, {});
  canvas.picture(0, 0, picture);
  // The panel grows leftwards from the lower right corner, a legend at a time.
  double width = kPad, height = 0;
  std::vector<std::pair<double, const RampLegend*>> shown_ramps;
  std::vector<std::pair<double, const ClassLegend*>> shown_classes;
  const auto place = [&](const auto& legend, auto& shown) {
    const Size s = size_of(canvas, legend);
    if (width + s.width + kGap + 2 * kPad > picture.width || s.height + 4 * kPad > picture.height) return;
    shown.emplace_back(width, &legend);
    width += s.width + kGap, height = std::max(height, s.height);
  };
  for (const RampLegend& r : ramps) place(r, shown_ramps);
  for (const ClassLegend& c : classes) place(c, shown_classes);
  if (shown_ramps.empty() && shown_classes.empty()) return;
  width += kPad - kGap, height += 2 * kPad;
  const double x = std::floor(picture.width - width - kPad), y = std::floor(picture.height - height - kPad);
  canvas.fill_rect(x, y, std::ceil(width), std::ceil(height), kPanel);
  canvas.frame_rect(x, y, std::ceil(width), std::ceil(height), 1, kLine);
  for (const auto& [at, legend] : shown_ramps) draw(canvas, x + at, y + kPad, *legend);
  for (const auto& [at, legend] : shown_classes) draw(canvas, x + at, y + kPad, *legend);
  picture = canvas.image();
}

}  // namespace patchwork
