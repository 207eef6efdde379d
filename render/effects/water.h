// Water up to a level.
#pragma once

#include "render/picture.h"

namespace patchwork {

template <class T>
class Fields;

namespace effects {

struct Water {
  double level = 0;    ///< metres
  double waves = 0.3;  ///< metres of height; 0: a mirror
  double clarity = 4;  ///< metres of water through which 1/e of the light passes
  Color color{0x1d, 0x4e, 0x63};
};
void describe(Fields<Water>& fields);

/// Is there ground below its level?
inline bool can_matter(const Water& water, double lowest) { return lowest < water.level; }

}  // namespace effects
}  // namespace patchwork
