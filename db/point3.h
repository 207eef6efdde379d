// A point over the domain.
#pragma once

namespace patchwork {

struct Point3 {
  double x = 0, y = 0, z = 0;  ///< metres
};

}  // namespace patchwork
