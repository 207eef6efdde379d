// Haze: far things take the colour of the air.
#pragma once

#include "render/picture.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Haze {
  double visibility = 50000;   ///< metres at which 2 % of the contrast is left
  double base = 0;             ///< metres: the height where that holds
  double scale_height = 8000;  ///< metres of height over which the air thins to 1/e
  Color color{0xc3, 0xd3, 0xe3};
};
void describe(Fields<Haze>& fields);

/// Optical depth a metre at a height.
double depth_per_metre(const Haze& haze, double height);
/// An upper bound of what it changes in a channel (sRGB, 0 to 1) of ground at most `farthest` metres away,
/// where the air is nowhere lower than `lowest`.
double most_change(const Haze& haze, double farthest, double lowest);

}  // namespace effects
}  // namespace patchwork
