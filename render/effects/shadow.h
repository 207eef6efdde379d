// Sun shadow: where terrain stands between the ground and the sun.
#pragma once

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Shadow {
  double softness = 0.53;  ///< degrees: the sun's own diameter, over which the shadow's edge fades
  double strength = 1;     ///< 1: no sun light at all in the shadow
};
void describe(Fields<Shadow>& fields);

}  // namespace effects
}  // namespace patchwork
