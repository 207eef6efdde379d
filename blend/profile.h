// Heights along a line over the ground.
#pragma once

#include <span>
#include <vector>

#include "blend/blend.h"

namespace patchwork {

struct ProfilePoint {
  double distance = 0;  ///< metres from the line's beginning, along the ground
  Point at;
  double height = 0, bound = 0;  ///< metres; NaN where there is no data
  std::int32_t source = 0;       ///< as in BlendOutput
};

struct Profile {
  std::vector<ProfilePoint> points;
  double length = 0;               ///< metres along the ground
  double missing = 0;              ///< of these, beside a point without data
  double lowest = 0, highest = 0;  ///< metres; NaN where nothing has data
  double ascent = 0, descent = 0;  ///< metres climbed and lost from point to point
  double bound_max = 0;            ///< metres
};

/// Points at every corner of the line and between them, evenly, at most `step` metres apart. Throws Error: a
/// line of less than two points, not finite, a step that is not above 0, more than 10^8 points.
Profile profile_along(const Evaluator& surface, std::span<const Point> line, double step);

}  // namespace patchwork
