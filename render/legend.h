// What colours stand for, drawn beside or onto a picture.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "render/color.h"

namespace patchwork {

/// A ramp with its values.
struct RampLegend {
  std::string title;  ///< with the unit: "Height, m"
  const ColorRamp* ramp = nullptr;
  ValueScale scale;
};

/// Colours with names.
struct ClassLegend {
  std::string title;
  std::vector<std::pair<Color, std::string>> classes;
};

/// The ramp upright, its last colour on top, 26 pixels wide and `height` high, ticks and numbers to the
/// right.
void draw_ramp(Canvas& canvas, double x, double top, double height, const RampLegend& legend);

/// Legends on a pale panel in the lower right corner; the picture's other pixels stay as they are. Those that
/// a picture is too small for are left out.
void draw_legends(Image& picture, std::span<const RampLegend> ramps, std::span<const ClassLegend> classes);

}  // namespace patchwork
