// Sky light: how much of the sky a place sees, by k directions, one bit each.
#pragma once

#include "render/picture.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Sky {
  int directions = 16;
  double strength = 1;  ///< 1: ground that sees no sky gets none of the light from everywhere
  Color color{0xdc, 0xe9, 0xff};
};
void describe(Fields<Sky>& fields);

}  // namespace effects
}  // namespace patchwork
