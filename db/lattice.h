// Rows of one pyramid level: every 2^level-th vertex, with a ring of two extrapolated vertices around the
// grid.
#pragma once

#include <cstddef>

#include "db/buffer.h"
#include "db/grid_shape.h"

namespace patchwork {

/// Codes of a run of rows of one level, as floats that hold integers exactly. Columns -2 .. cols + 1 can be
/// read; rows -2 .. rows + 1 can where the run reaches that end of the grid.
class Lattice {
 public:
  Lattice() = default;
  /// Room for level rows [first, first + count).
  Lattice(const GridShape& shape, int level, int first, int count);

  int level() const { return level_; }
  int cols() const { return cols_; }  ///< of the whole level
  int rows() const { return rows_; }  ///< of the whole level
  int first() const { return first_; }
  int count() const { return count_; }
  float* row(int r) { return samples_.data() + offset(r); }
  const float* row(int r) const { return samples_.data() + offset(r); }

  /// Fills the ring from the vertices inside, linearly: v[-m] = v[0] + m (v[0] - v[1]), and so at each end.
  void extrapolate_ring();

 private:
  std::size_t offset(int r) const { return size_t(r - first_ + 2) * size_t(cols_ + 4) + 2; }
  void extrapolate_row(int from, int towards_inside, int m);
  int level_ = 0, cols_ = 0, rows_ = 0, first_ = 0, count_ = 0;
  Buffer<float> samples_;  // not cleared: what can be read is written first
};

/// The vertices that a level takes from the grid along one axis of n samples: 0, 2^level, ... and, where the
/// lattice ends beyond the last sample, the value there continued linearly from the last sample over one
/// step.
struct LatticeAxis {
  LatticeAxis(int samples, int level);
  int step, stored;  ///< level-0 cells between vertices; number of vertices
  int last, before;  ///< samples that the continuation uses
  double weight;  ///< value = f(last) + weight (f(last) - f(before)) at the stored vertex beyond; 0 if none
  bool beyond() const { return weight > 0; }
};

/// Builds rows [first, first + count) of a level; `sample(i, j)` gives the code at level-0 vertex (i, j).
template <class Sample>
Lattice make_lattice(const GridShape& shape, int level, int first, int count, Sample sample);

}  // namespace patchwork

#include "db/lattice_build.h"
