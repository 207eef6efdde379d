// Hypsometric tints: the ground's colour by its height.
#pragma once

#include <optional>

#include "render/color.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Tints {
  RampName ramp = RampName::land;
  std::optional<double> lowest, highest;  ///< metres; without: of the terrain
};
void describe(Fields<Tints>& fields);

}  // namespace effects
}  // namespace patchwork
