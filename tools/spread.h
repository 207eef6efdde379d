// How figures of one thing, measured several times, are spread.
#pragma once

#include <vector>

namespace patchwork::cli {

struct Spread {
  double min = 0, median = 0, max = 0;
  static Spread of(std::vector<double> values);  ///< REQUIRES: not empty
};

}  // namespace patchwork::cli
