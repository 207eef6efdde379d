// How far what is shown lies from the best surface there is.
#pragma once

#include <span>
#include <vector>

#include "blend/blend.h"
#include "render/camera.h"

namespace patchwork::cli {

struct ErrorFigures {
  double max = 0, p99 = 0, rms = 0;
};

/// Of distances that are overwritten; zeros where there are none.
ErrorFigures figures_of(std::vector<double>& distances);

/// Pixels: the vertical distance from `best` of what a pixel shows, as it is seen there. `depth`: metres
/// along the ray through each pixel's centre, row-major; NaN where there is nothing. Of every n-th pixel in
/// every n-th row. Nothing of pixels where `best` has no height: the outline of the data is drawn to a cell.
std::vector<double> screen_distances(const Blend& best, const Camera& camera, std::span<const float> depth,
                                     int every = 1);

}  // namespace patchwork::cli
