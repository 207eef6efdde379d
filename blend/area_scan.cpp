#include "blend/area_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace patchwork {

namespace {

constexpr int kBand = 1 << 20;  // pixels evaluated together, or a row

}  // namespace

double Area::pixel() const { return std::abs(frame.xc * frame.yr - frame.xr * frame.yc); }

void scan_area(const Evaluator& surface, const Area& area, const std::function<void(const AreaRow&)>& visit) {
  if (area.width <= 0 || area.height <= 0) return;
  const auto width = std::size_t(area.width);
  const int band = std::clamp(kBand / area.width, 1, area.height);
  std::vector<double> height(width * std::size_t(band)), bound(height.size());
  std::vector<std::int32_t> source(height.size());
  for (int row = 0; row < area.height; row += band) {
    const int rows = std::min(band, area.height - row);
    surface.at_pixels(area.frame, area.width, row, rows,
                      {.height = height, .bound = bound, .source = source, .patch = {}});
    for (int r = 0; r < rows; ++r) {
      const std::size_t from = std::size_t(r) * width;
      visit({row + r, std::span<const double>(height).subspan(from, width),
             std::span<const double>(bound).subspan(from, width),
             std::span<const std::int32_t>(source).subspan(from, width)});
    }
    if (area.progress) area.progress(double(row + rows) / area.height);
  }
}

}  // namespace patchwork
