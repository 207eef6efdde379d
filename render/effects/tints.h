// Hypsometric tints: the ground's colour by its height.
#pragma once

#include <optional>

namespace patchwork {

template <class T>
class Fields;

namespace effects {

enum class Ramp { land, viridis, cividis, grey };

struct Tints {
  Ramp ramp = Ramp::land;
  std::optional<double> lowest, highest;  ///< metres; without: of the terrain
};
void describe(Fields<Tints>& fields);

}  // namespace effects
}  // namespace patchwork
