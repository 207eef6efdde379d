// Surfaces over an area, pixel by pixel (used by accuracy.cpp and volume.cpp).
#pragma once

#include <functional>
#include <span>

#include "blend/blend.h"

namespace patchwork {

/// An area as the pixels of a raster whose centres lie in it.
struct Area {
  RasterFrame frame;  ///< of the pixel centres
  int width = 0, height = 0;
  std::function<bool(Point)> inside = {};     ///< may be empty: all of the raster
  std::function<void(double)> progress = {};  ///< may be empty; told the share of rows that is done

  double pixel() const;  ///< square metres
  Point centre(int c, int r) const { return frame.at(c, r); }
};

/// A row of the area, evaluated.
struct AreaRow {
  int row = 0;
  std::span<const double> height, bound;              ///< metres; NaN where there is no data
  std::span<const std::int32_t> source;               ///< as in BlendOutput
  std::span<const double> other_height, other_bound;  ///< of the other surface, if there is one
};

/// Calls visit(row) for each row of the area, from the first on. `other` may be null.
void scan_area(const Evaluator& surface, const Evaluator* other, const Area& area,
               const std::function<void(const AreaRow&)>& visit);

}  // namespace patchwork
