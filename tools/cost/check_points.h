// Where errors are measured, and what the best there is says there.
#pragma once

#include <vector>

#include "tools/cost/cost.h"

namespace patchwork::cli {

/// Random points, one in each cell of a lattice over the extent, and the best available surface there: error
/// 0, k = 0, priority, on the CPU in double.
class CheckPoints {
 public:
  CheckPoints(const Database& db, const Extent& extent, int count);

  std::size_t size() const { return x_.size(); }
  const std::vector<double>& x() const { return x_; }
  const std::vector<double>& y() const { return y_; }

  /// Fills bound, error and beyond of `row`. `scale[k]`: metres to the row's unit, negative where the point
  /// is not looked at; empty: metres everywhere. `float32`: the engine computes in it.
  void compare(const Evaluator& surface, std::span<const double> scale, bool float32, CostRow& row) const;
  /// The same for heights that come without bounds.
  ErrorFigures figures(std::span<const double> heights, std::span<const double> scale) const;

 private:
  std::vector<double> x_, y_, best_, best_bound_;
};

}  // namespace patchwork::cli
