// The coverage predicates in exact rational arithmetic, without any filter (internal to coverage).
#pragma once

#include <span>

#include "db/coverage.h"

namespace patchwork::coverage {

/// As patchwork::covered, always right; some hundred microseconds for ten rectangles. REQUIRES: finite
/// numbers.
bool covered_exact(const OrientedRect& target, std::span<const OrientedRect> covers);

/// As patchwork::compare_areas, always right. REQUIRES: finite numbers.
int compare_areas_exact(const OrientedRect& a, const OrientedRect& b);

}  // namespace patchwork::coverage
