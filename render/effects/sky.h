// Sky light: how much of the sky a place sees, by k directions, 4 to 32.
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

/// Tangent of the elevation of the lowest of its directions: above 3.58 degrees (sin^2 of that is what a
/// horizon of that height takes of the light, 1/256) for up to 128 directions.
double lowest_direction(const Sky& sky);
/// False only if no direction is hidden anywhere where terrain rises by at most `steepest`.
bool can_matter(const Sky& sky, double steepest);

}  // namespace effects
}  // namespace patchwork
