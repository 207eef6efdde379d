// How accurate a surface is over an area, where it is best and worst, and which grids answer.
#pragma once

#include <limits>
#include <vector>

#include "blend/area_scan.h"

namespace patchwork {

struct Accuracy {
  struct Place {
    double bound = std::numeric_limits<double>::quiet_NaN();  ///< metres
    Point at;
  };
  Place best, worst;              ///< the first one of equal bounds, row by row; NaN where nothing has data
  double answered = 0;            ///< square metres with data
  double missing = 0;             ///< square metres without
  double filled = 0;              ///< of those answered, where only filled cells reply
  double mean = 0;                ///< of the bounds, metres
  double median = 0, p95 = 0;     ///< metres: half, 95 % of the area has this bound or a smaller one; to 1 %
  std::vector<double> by_source;  ///< square metres where place k of Database::grids() speaks most
};

/// `grids`: how many the database has.
Accuracy accuracy_over(const Evaluator& surface, const Area& area, std::size_t grids);

}  // namespace patchwork
