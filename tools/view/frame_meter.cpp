#include "tools/view/frame_meter.h"

#include <fmt/format.h>

namespace patchwork::cli {

namespace {

// 1234567 as "1 234 567".
std::string grouped(std::uint64_t n) {
  std::string digits = std::to_string(n);
  for (int at = int(digits.size()) - 3; at > 0; at -= 3) digits.insert(std::size_t(at), 1, ' ');
  return digits;
}

std::string pixels(double px) { return fmt::format("{:.2f} px", px); }

constexpr std::pair<const char*, double FrameStats::*> kStages[] = {
    {"select", &FrameStats::select_ms}, {"extract", &FrameStats::extract_ms},
    {"send", &FrameStats::send_ms},     {"blend", &FrameStats::blend_ms},
    {"finish", &FrameStats::finish_ms}, {"tessellate", &FrameStats::factors_ms},
    {"light", &FrameStats::light_ms},   {"draw", &FrameStats::draw_ms},
};

}  // namespace

void FrameMeter::add(const FrameStats& f, double show_ms) {
  sum_.tiles_made += f.tiles_made;
  const std::uint64_t triangles = f.redrawn ? f.triangles : last_.triangles;
  last_ = f, last_.triangles = triangles;
  if (!f.redrawn) return;
  for (const auto& [name, ms] : kStages) sum_.*ms += f.*ms;
  sum_.total_ms += f.total_ms, show_ms_ += show_ms, ++frames_;
}

Rows FrameMeter::rows() {
  if (frames_ > 0) {
    const double total = (sum_.total_ms + show_ms_) / frames_;
    stages_ = {{"Frame", fmt::format("{:.1f} ms", total)}};
    for (const auto& [name, ms] : kStages)
      stages_.emplace_back(std::string("    ") + name, fmt::format("{:.2f}", sum_.*ms / frames_));
    stages_.emplace_back("    show", fmt::format("{:.2f}", show_ms_ / frames_));
  }
  Rows rows{{"Error asked", pixels(last_.pixels_asked)},
            {"Error reached", pixels(last_.pixels_reached)},
            {"Bound", fmt::format("{:.3g} m", last_.bound_max)},
            {}};
  rows.insert(rows.end(), stages_.begin(), stages_.end());
  rows.insert(rows.end(), {{},
                           {"Tiles drawn", grouped(last_.tiles_drawn)},
                           {"Tiles made", grouped(sum_.tiles_made)},
                           {"Tiles wanted", grouped(last_.tiles_wanted)},
                           {"Tiles too coarse", grouped(last_.tiles_coarse)},
                           {"Triangles", last_.triangles > 0 ? grouped(last_.triangles) : "-"}});
  sum_ = {}, show_ms_ = 0, frames_ = 0;
  return rows;
}

}  // namespace patchwork::cli
