// A bound on the cost of a warp, by place: what it adds to the accuracy there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "db/frame.h"

namespace patchwork {

/// Largest values over blocks of kBlock x kBlock cells of a lattice.
class CostField {
 public:
  static constexpr int kBlock = 16;
  CostField() = default;
  CostField(int width, int height)
      : cols_(width / kBlock + 1),
        rows_(height / kBlock + 1),
        most_(std::size_t(cols_) * std::size_t(rows_)) {}

  bool empty() const { return most_.empty(); }
  /// A value seen at lattice position (i, j); it counts for the cells around.
  void note(double i, double j, double value) {
    largest_ = std::max(largest_, value);
    for (int b = block(j - 1, rows_); b <= block(j + 1, rows_); ++b)
      for (int a = block(i - 1, cols_); a <= block(i + 1, cols_); ++a) {
        double& m = most_[std::size_t(b) * std::size_t(cols_) + std::size_t(a)];
        m = std::max(m, value);
      }
  }
  double largest() const { return largest_; }
  /// The largest value noted in the blocks that a rectangle touches; 0 for an empty field.
  double most(const LatticeRect& r) const {
    double worst = 0;
    if (empty()) return worst;
    for (int b = block(r.j0, rows_); b <= block(r.j1, rows_); ++b)
      for (int a = block(r.i0, cols_); a <= block(r.i1, cols_); ++a)
        worst = std::max(worst, most_[std::size_t(b) * std::size_t(cols_) + std::size_t(a)]);
    return worst;
  }

 private:
  static int block(double at, int blocks) { return std::clamp(int(std::floor(at / kBlock)), 0, blocks - 1); }
  int cols_ = 0, rows_ = 0;
  std::vector<double> most_;
  double largest_ = 0;
};

}  // namespace patchwork
