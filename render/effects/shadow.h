// Sun shadow: where terrain stands between the ground and the sun.
#pragma once

#include "render/effects/sun.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Shadow {
  double softness = 0.53;  ///< degrees: the sun's own diameter, over which the shadow's edge fades
  double strength = 1;     ///< 1: no sun light at all in the shadow
};
void describe(Fields<Shadow>& fields);

/// False only if no place whose terrain rises by `steepest` (tangent) lies in any shadow, nor in its fading
/// edge; or if the sun is down.
bool can_matter(const Shadow& shadow, const Sun& sun, double steepest);

}  // namespace effects
}  // namespace patchwork
