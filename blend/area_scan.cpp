#include "blend/area_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace patchwork {

namespace {

constexpr int kBand = 1 << 20;  // pixels evaluated together, or a row

}  // namespace

double Area::pixel() const { return std::abs(frame.xc * frame.yr - frame.xr * frame.yc); }

void scan_area(const Evaluator& surface, const Evaluator* other, const Area& area,
               const std::function<void(const AreaRow&)>& visit) {
  if (area.width <= 0 || area.height <= 0) return;
  const auto width = std::size_t(area.width);
  const int band = std::clamp(kBand / area.width, 1, area.height);
  std::vector<double> height(width * std::size_t(band)), bound(height.size());
  std::vector<double> other_height(other ? height.size() : 0), other_bound(other_height.size());
  std::vector<std::int32_t> source(height.size());
  for (int row = 0; row < area.height; row += band) {
    const int rows = std::min(band, area.height - row);
    surface.at_pixels(area.frame, area.width, row, rows,
                      {.height = height, .bound = bound, .source = source, .patch = {}});
    if (other)
      other->at_pixels(area.frame, area.width, row, rows,
                       {.height = other_height, .bound = other_bound, .source = {}, .patch = {}});
    for (int r = 0; r < rows; ++r) {
      const auto of = [&](const auto& band_of) {
        return std::span(band_of).subspan(band_of.empty() ? 0 : std::size_t(r) * width,
                                          band_of.empty() ? 0 : width);
      };
      visit({row + r, of(height), of(bound), of(source), of(other_height), of(other_bound)});
    }
    if (area.progress) area.progress(double(row + rows) / area.height);
  }
}

}  // namespace patchwork
