// What gates look at: an effect that cannot change a pixel by more than 1/255 is not called for.
#pragma once

#include <limits>

#include "render/camera.h"

namespace patchwork::effects {

/// Of all that a picture shows.
struct SceneView {
  Camera camera;
  double lowest = 0, highest = 0;  ///< of the terrain in view, metres
  double farthest = 0;             ///< metres to the farthest terrain in view
  /// Tangent of the steepest angle under which any place sees terrain; never too small.
  double steepest = std::numeric_limits<double>::infinity();
};

/// Of a tile.
struct TileView {
  double lowest = 0, highest = 0;                                ///< metres
  double farthest = 0;                                           ///< metres to its farthest point
  double steepest = std::numeric_limits<double>::infinity();     ///< as above, of its own places
  double lowest_air = -std::numeric_limits<double>::infinity();  ///< metres: between the eye and it
};

/// Half a step of an 8-bit channel either way: what a gate may neglect, of sRGB's 0 to 1.
inline constexpr double kInvisible = 1.0 / 255;

}  // namespace patchwork::effects
