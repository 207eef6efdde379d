// Sun light: the ground by its normals, and how bright what the sun does not reach is.
#pragma once

#include "render/picture.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Sun {
  double azimuth = 315;   ///< degrees, clockwise from north, where the sun stands
  double elevation = 45;  ///< degrees above the horizon
  double strength = 1;    ///< of its light on ground that faces it
  double ambient = 0.25;  ///< light that comes from everywhere
  Color color{0xff, 0xf4, 0xe5};
};
void describe(Fields<Sun>& fields);

}  // namespace effects
}  // namespace patchwork
