// A shaded relief of a height raster, with its legend.
#pragma once

#include <span>
#include <string>

#include "render/picture.h"

namespace patchwork {

/// A picture of about 1000 to 1400 pixels: shaded relief under a hypsometric tint, a ramp with heights in
/// metres and a scale bar. `heights` row-major from the north, not finite where there is none (hatched);
/// `step_metres` between samples. Larger rasters are averaged, smaller ones interpolated. `title` may be
/// empty. Throws Error: a size below 1 x 1 or other than the heights', a step that is not above 0.
Image hillshade(std::span<const float> heights, int width, int height, double step_metres,
                const std::string& title = {});

}  // namespace patchwork
