// Volumes between two surfaces, or a surface and a plane, with what the bounds leave open.
#pragma once

#include "blend/area_scan.h"

namespace patchwork {

/// Where one surface lies above the other.
struct VolumePart {
  double area = 0;             ///< square metres
  double volume = 0;           ///< cubic metres
  double least = 0, most = 0;  ///< cubic metres: whatever the two are within their bounds
};

/// Sums over pixels (midpoint rule): exact for bilinear cells that are the pixels, else converging with their
/// square.
struct Volume {
  VolumePart above, below;  ///< the first surface over the second, and under it
  double area = 0;          ///< square metres where both have data
  double missing = 0;       ///< square metres of the area where one has none
  double undecided = 0;     ///< square metres where the bounds do not tell which is the higher
  double error = 0;         ///< cubic metres: the difference of volumes is right to this, by the bounds
  double net() const { return above.volume - below.volume; }
};

Volume volume_between(const Evaluator& surface, const Evaluator& other, const Area& area);
Volume volume_over_plane(const Evaluator& surface, double height, const Area& area);

}  // namespace patchwork
