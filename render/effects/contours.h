// Contour lines of constant width on the screen.
#pragma once

#include "render/picture.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Contours {
  double interval = 100;  ///< metres
  int index = 5;          ///< every so many lines one is bold; 0: none
  double width = 1;       ///< pixels; bold lines are twice as wide
  Color color{0x4a, 0x33, 0x22};
  double opacity = 0.7;
};
void describe(Fields<Contours>& fields);

/// Can a line reach ground between two heights? contours.glsl lets none reach farther than a quarter of the
/// interval.
bool can_matter(const Contours& contours, double lowest, double highest);

}  // namespace effects
}  // namespace patchwork
