#include "db/lattice.h"

#include <algorithm>

namespace patchwork {

Lattice::Lattice(const GridShape& shape, int level, int first, int count)
    : level_(level),
      cols_(shape.lattice_cols(level)),
      rows_(shape.lattice_rows(level)),
      first_(first),
      count_(count),
      samples_(size_t(count + 4) * size_t(cols_ + 4)) {}

void Lattice::extrapolate_row(int from, int towards_inside, int m) {
  const float *a = row(from), *b = row(from + towards_inside);
  float* out = row(from - towards_inside * m);
  for (int c = -2; c < cols_ + 2; ++c) out[c] = a[c] + float(m) * (a[c] - b[c]);
}

void Lattice::extrapolate_ring() {
  for (int r = first_; r < first_ + count_; ++r) {
    float* v = row(r);
    for (int m = 1; m <= 2; ++m) {
      v[-m] = v[0] + float(m) * (v[0] - v[1]);
      v[cols_ - 1 + m] = v[cols_ - 1] + float(m) * (v[cols_ - 1] - v[cols_ - 2]);
    }
  }
  for (int m = 1; m <= 2; ++m) {
    if (first_ == 0) extrapolate_row(0, 1, m);
    if (first_ + count_ == rows_) extrapolate_row(rows_ - 1, -1, m);
  }
}

LatticeAxis::LatticeAxis(int samples, int level)
    : step(1 << level), stored(((samples - 2) >> level) + 2), last(samples - 1) {
  before = std::max(0, last - step);
  weight = double((stored - 1) * step - last) / (last - before);
}

}  // namespace patchwork
