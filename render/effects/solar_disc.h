// The sun itself, in the sky.
#pragma once

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct SolarDisc {
  double diameter = 0.533;  ///< degrees
  double glow = 0.3;        ///< brightness of the air around it
};
void describe(Fields<SolarDisc>& fields);

}  // namespace effects
}  // namespace patchwork
