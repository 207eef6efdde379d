// Exact predicates on oriented rectangles: is one covered by the union of others, and which is larger.
#pragma once

#include <cstdint>
#include <span>

#include "db/frame.h"

namespace patchwork {

/// The image of a lattice rectangle under a frame, in exact arithmetic on the stored doubles.
struct OrientedRect {
  const Frame* frame = nullptr;
  LatticeRect rect;
};

/// How often each step of the filter decided.
struct CoverageCounts {
  std::uint64_t integer = 0, interval = 0, exact = 0;
  CoverageCounts& operator+=(const CoverageCounts& o) {
    integer += o.integer, interval += o.interval, exact += o.exact;
    return *this;
  }
};

/// True if `target` is a subset of the union of `covers` (closed sets, exact). Same-frame questions are
/// decided on lattice coordinates ("integer"), the rest by interval arithmetic, and what that leaves open by
/// CGAL. A caller that wants covers grown passes grown rectangles. An empty target is covered, an empty cover
/// covers nothing. Takes about 0.1 microseconds where one cover or one missed point decides. REQUIRES: finite
/// numbers.
bool covered(const OrientedRect& target, std::span<const OrientedRect> covers, CoverageCounts& counts);

/// The sign of area(a) - area(b), exact. REQUIRES: neither is empty.
int compare_areas(const OrientedRect& a, const OrientedRect& b, CoverageCounts& counts);

}  // namespace patchwork
