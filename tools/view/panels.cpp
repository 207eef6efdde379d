#include "tools/view/panels.h"

#include <algorithm>
#include <set>

#include "render/color.h"

namespace patchwork::cli {

namespace {

constexpr Color kPaper{0xf7, 0xf7, 0xf2}, kInk{0x22, 0x22, 0x22}, kPale{0x6b, 0x6b, 0x6b};
constexpr Color kFrame{0xc9, 0xc9, 0xc2}, kWhite{0xff, 0xff, 0xff};
constexpr Color kGround{0x9a, 0xa0, 0xa6};
constexpr int kMargin = 10, kLine = 17, kGap = 7, kTitle = 22;  // pixels
constexpr int kMapSide = 260, kLegend = 40;
constexpr TextStyle kText{.size = 12, .color = kInk};

// Where a point of the domain lies on the map.
struct Plan {
  double left, top, scale;  // pixels, pixels a metre
  Extent place;
  Point operator()(Point p) const {
    return {left + (p.x - place.xmin) * scale, top + (place.ymax - p.y) * scale};
  }
  Extent area() const {
    const Point a = (*this)({place.xmin, place.ymax}), b = (*this)({place.xmax, place.ymin});
    return {a.x, a.y, b.x, b.y};
  }
};

// Fine tiles are bright.
Color level_color(int level, int levels) {
  return color_ramp(RampName::viridis).at(1 - double(level) / std::max(levels - 1, 1));
}

// The part of a tile that lies on the map.
void fill_tile(Canvas& canvas, const Plan& plan, const Extent& tile, Color color) {
  const Extent shown = tile.common(plan.place);
  const Point a = plan({shown.xmin, shown.ymax}), b = plan({shown.xmax, shown.ymin});
  if (a.x >= b.x || a.y >= b.y) return;
  canvas.fill_rect(a.x, a.y, b.x - a.x, b.y - a.y, color);
  const Point corners[] = {a, {b.x, a.y}, b, {a.x, b.y}};
  canvas.outline(corners, 0.5, kInk, 0.6, plan.area());
}

// The eye, and the directions of the picture's left and right edges.
void draw_camera(Canvas& canvas, const Plan& plan, const Camera& camera) {
  const glm::dvec3 ahead = axes(camera).forward;
  const double heading = std::atan2(ahead.y, ahead.x);
  const double half = std::atan(camera.tan_half() * camera.width / camera.height);
  const Point eye = plan({camera.eye.x, camera.eye.y});
  const auto edge = [&](double angle) {
    return Point{eye.x + 2 * kMapSide * std::cos(angle), eye.y - 2 * kMapSide * std::sin(angle)};
  };
  const Point cone[] = {eye, edge(heading + half), edge(heading - half)};
  canvas.outline(cone, 3, kInk, 0.5, plan.area()), canvas.outline(cone, 1.5, kWhite, 1, plan.area());
}

void draw_levels(Canvas& canvas, const TileLattice& lattice, const std::set<int>& levels) {
  const double each = std::min(56.0, double(kMapSide) / std::max<double>(1, double(levels.size())));
  double x = kMargin;
  for (const int level : levels) {
    canvas.fill_rect(x, kTitle + kMapSide + 2 * kGap, each - 2, 8, level_color(level, lattice.levels()));
    const std::string step = number_text(lattice.step(level));
    if (canvas.text_width(step, {.size = 10}) < each)
      canvas.text(x, kTitle + kMapSide + kLegend - 5, step, {.size = 10, .color = kPale});
    x += each;
  }
}

}  // namespace

Image table_panel(const std::string& title, const Rows& rows, int width) {
  const auto gap = [](const auto& row) { return row.first.empty() && row.second.empty(); };
  int height = kTitle + 2 * kMargin;
  for (const auto& row : rows) height += gap(row) ? kGap : kLine;
  Canvas canvas(width, height, kPaper);
  canvas.frame_rect(0, 0, width, height, 1, kFrame);
  canvas.text(kMargin, kMargin + 12, canvas.fitted(title, width - 2 * kMargin, {.size = 13, .bold = true}),
              {.size = 13, .bold = true, .color = kInk});
  int y = kMargin + kTitle;
  for (const auto& row : rows) {
    y += gap(row) ? kGap : kLine;
    if (gap(row)) continue;
    canvas.text(kMargin, y - 5, row.first, {.size = kText.size, .color = kPale});
    canvas.text(width - kMargin, y - 5, row.second,
                {.size = kText.size, .align = Align::right, .color = kInk});
  }
  return canvas.image();
}

Image map_panel(const TileLattice& lattice, const TileMap& map) {
  const double wide = map.place.xmax - map.place.xmin, high = map.place.ymax - map.place.ymin;
  const double scale = kMapSide / std::max(wide, high);
  const Plan plan{kMargin + 0.5 * (kMapSide - wide * scale), kTitle + kGap + 0.5 * (kMapSide - high * scale),
                  scale, map.place};
  Canvas canvas(kMapSide + 2 * kMargin, kTitle + kMapSide + kLegend + kGap, kPaper);
  canvas.frame_rect(0, 0, kMapSide + 2 * kMargin, kTitle + kMapSide + kLegend + kGap, 1, kFrame);
  canvas.text(kMargin, kMargin + 10, "Tiles by step, m", {.size = 12, .bold = true, .color = kInk});
  const Extent area = plan.area();
  canvas.fill_rect(area.xmin, area.ymin, area.xmax - area.xmin, area.ymax - area.ymin, kGround);
  std::set<int> levels;
  for (const TileKey& tile : map.tiles) {
    fill_tile(canvas, plan, lattice.bounds(tile), level_color(tile.level, lattice.levels()));
    levels.insert(tile.level);
  }
  for (Corners corners : map.outlines) {
    for (Point& p : corners) p = plan(p);
    canvas.outline(corners, 1.5, kWhite, 0.9, plan.area());
  }
  draw_camera(canvas, plan, map.camera);
  draw_levels(canvas, lattice, levels);
  return canvas.image();
}

Image legend_panel(const Renderer& renderer, int width, int height) {
  constexpr Color nothing{0xff, 0x00, 0xff};
  Image all(width, height, nothing);
  renderer.draw_legend(all);
  int left = width, right = 0, top = height, bottom = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (all.at(x, y) != nothing) {
        left = std::min(left, x), right = std::max(right, x + 1);
        top = std::min(top, y), bottom = std::max(bottom, y + 1);
      }
  if (left >= right) return {};
  Image cut(right - left, bottom - top, {});
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) cut.at(x - left, y - top) = all.at(x, y);
  return cut;
}

}  // namespace patchwork::cli
