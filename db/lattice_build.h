// How a level's vertices are taken from the grid's samples (included by lattice.h).
#pragma once

#include <oneapi/tbb/parallel_for.h>

#include <cmath>

namespace patchwork {

template <class Sample>
Lattice make_lattice(const GridShape& shape, int level, int first, int count, Sample sample) {
  Lattice lattice(shape, level, first, count);
  const LatticeAxis ai(shape.width(), level), aj(shape.height(), level);
  const auto along_i = [&](int c, int y) -> double {
    if (c + 1 < ai.stored || !ai.beyond()) return sample(c * ai.step, y);
    const double last = sample(ai.last, y);
    return last + ai.weight * (last - sample(ai.before, y));
  };
  tbb::parallel_for(first, first + count, [&](int r) {
    float* out = lattice.row(r);
    const bool beyond = r + 1 == aj.stored && aj.beyond();
    const auto value = [&](int c) -> double {
      if (!beyond) return along_i(c, r * aj.step);
      const double last = along_i(c, aj.last);
      return last + aj.weight * (last - along_i(c, aj.before));
    };
    // Samples are codes already; only what is continued beyond the last of them must be rounded to one.
    const int whole = beyond ? 0 : ai.beyond() ? ai.stored - 1 : ai.stored;
    for (int c = 0; c < whole; ++c) out[c] = float(sample(c * ai.step, r * aj.step));
    for (int c = whole; c < ai.stored; ++c) out[c] = float(std::nearbyint(value(c)));
  });
  lattice.extrapolate_ring();
  return lattice;
}

}  // namespace patchwork
