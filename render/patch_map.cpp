#include "render/patch_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "db/error.h"
#include "render/color.h"

namespace patchwork {
namespace {

constexpr int kMargin = 24, kGap = 32, kPanelWidth = 640, kPanelHeight = 820, kLeastPanel = 300;
constexpr int kTitle = 40, kHeading = 26, kRow = 24, kFoot = 34;
constexpr Color kInk{0x1c, 0x1c, 0x1c}, kFrame{0x88, 0x88, 0x88};

// ColorBrewer's RdYlBu, safe for the colour-blind, without its two near-whites: red is small, blue large.
constexpr Color kSizes[] = {{0xa5, 0x00, 0x26}, {0xd7, 0x30, 0x27}, {0xf4, 0x6d, 0x43},
                            {0xfd, 0xae, 0x61}, {0xfe, 0xe0, 0x90}, {0xab, 0xd9, 0xe9},
                            {0x74, 0xad, 0xd1}, {0x45, 0x75, 0xb4}, {0x31, 0x36, 0x95}};
constexpr size_t kSizeColors = std::size(kSizes);

// One line of a legend: what the colour stands for and how many pixels have it.
struct Entry {
  std::string name;
  Color color;
  size_t pixels = 0;
};

bool answered(const PatchMapInput& in, size_t k) {
  return in.kernel_metres[k] > 0 && std::isfinite(in.kernel_metres[k]);
}
bool is_filled(const PatchMapInput& in, size_t k) { return !in.filled.empty() && in.filled[k]; }

// Sizes of different grids that a person would call the same (two digits alike) share a class.
double size_class(double metres) {
  const double unit = std::pow(10.0, std::floor(std::log10(metres)) - 1);
  return std::round(metres / unit) * unit;
}

// Too many sizes for the palette: a class an octave, named by its middle; what is smaller than the palette
// reaches shares its end.
double octave_class(double metres, double largest) {
  const double octaves = std::round(std::log2(largest / metres));
  return largest * std::exp2(-std::min(octaves, double(kSizeColors - 1)));
}

// The pixels' classes: `of` maps a pixel's size to its entry, smallest size first.
struct SizeLegend {
  std::map<float, size_t> of;
  std::vector<Entry> entries;
};

// Counts the few distinct sizes first; the pixels are looked at once.
SizeLegend size_legend(const PatchMapInput& in) {
  std::map<float, size_t> pixels;
  for (size_t k = 0; k < in.kernel_metres.size(); ++k)
    if (answered(in, k)) ++pixels[in.kernel_metres[k]];
  std::map<double, size_t> classes;
  for (auto [metres, n] : pixels) classes[size_class(metres)] += n;
  const bool octaves = classes.size() > kSizeColors;
  const double largest = octaves ? classes.rbegin()->first : 0;
  const auto class_of = [&](double metres) {
    const double c = size_class(metres);
    return octaves ? octave_class(c, largest) : c;
  };
  if (octaves) {
    classes.clear();
    for (auto [metres, n] : pixels) classes[class_of(metres)] += n;
  }
  SizeLegend legend;
  for (auto [metres, n] : classes) {
    // Few sizes spread over the whole palette, so that small and large look unlike.
    const size_t i = legend.entries.size(), last = classes.size() - 1;
    const size_t color = last == 0 ? kSizeColors - 3 : (i * (kSizeColors - 1) + last / 2) / last;
    legend.entries.push_back({(octaves ? "about " : "") + length_text(metres), kSizes[color], n});
  }
  for (auto [metres, n] : pixels)
    legend.of[metres] = size_t(std::distance(classes.begin(), classes.find(class_of(metres))));
  return legend;
}

// The grids that answer anywhere, the largest area first.
struct GridLegend {
  std::vector<Color> of;  // by grid index
  std::vector<Entry> entries;
  size_t filled = 0;
};

GridLegend grid_legend(const PatchMapInput& in) {
  GridLegend legend;
  std::vector<size_t> pixels(in.grid_names.size()), order;
  for (size_t k = 0; k < in.grid.size(); ++k)
    if (answered(in, k)) ++pixels[in.grid[k]], legend.filled += is_filled(in, k);
  for (size_t g = 0; g < pixels.size(); ++g)
    if (pixels[g]) order.push_back(g);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return pixels[a] > pixels[b]; });
  legend.of.assign(in.grid_names.size(), class_color(kClassColors));
  size_t others = 0;
  for (size_t rank = 0; rank < order.size(); ++rank) {
    if (rank >= kClassColors) {
      others += pixels[order[rank]];
      continue;
    }
    legend.of[order[rank]] = class_color(rank);
    legend.entries.push_back({in.grid_names[order[rank]], class_color(rank), pixels[order[rank]]});
  }
  if (others)
    legend.entries.push_back(
        {std::to_string(order.size() - kClassColors) + " more grids", class_color(kClassColors), others});
  return legend;
}

// Filled cells carry pale stripes over their grid's colour.
Color striped(Color c, int x, int y) {
  const auto pale = [](std::uint8_t v) { return std::uint8_t(v + (255 - v) * 2 / 3); };
  return (x - y + 4096) % 8 < 3 ? Color{pale(c.r), pale(c.g), pale(c.b)} : c;
}

struct Panel {
  int x, y, width, height;  // on the canvas
  double scale;             // canvas pixels per input pixel
};

// Classes must not be averaged: each pixel of the panel takes the input pixel under its middle.
template <typename ColorOf>
Image panel_image(const PatchMapInput& in, const Panel& panel, ColorOf&& color_of) {
  Image image(panel.width, panel.height, {});
  for (int y = 0; y < panel.height; ++y) {
    const size_t row = size_t(std::min(in.height - 1, int((y + 0.5) / panel.scale)));
    for (int x = 0; x < panel.width; ++x) {
      const size_t k = row * size_t(in.width) + size_t(std::min(in.width - 1, int((x + 0.5) / panel.scale)));
      image.at(x, y) = answered(in, k) ? color_of(k, x, y) : hatch_color(x, y);
    }
  }
  return image;
}

// Thin and not quite black: at a thousand patches full lines would darken the colours that they part.
void draw_outlines(Canvas& canvas, const PatchMapInput& in, const Panel& panel) {
  const Extent clip{double(panel.x), double(panel.y), double(panel.x + panel.width),
                    double(panel.y + panel.height)};
  for (const auto& outline : in.outlines) {
    std::array<Point, 4> corners;
    for (size_t c = 0; c < corners.size(); ++c)
      corners[c] = {panel.x + panel.scale * outline[c].x, panel.y + panel.scale * outline[c].y};
    canvas.outline(corners, 0.7, kInk, 0.75, clip);
  }
}

std::string share_text(size_t pixels, size_t all) {
  const double percent = 100.0 * double(pixels) / double(all);
  char text[16];
  std::snprintf(text, sizeof text,
                percent < 0.1  ? "< 0.1 %%"
                : percent < 10 ? "%.1f %%"
                               : "%.0f %%",
                percent);
  return text;
}

// An entry at row `i` of a legend of two columns, filled downwards.
void draw_entry(Canvas& canvas, const Panel& panel, double top, size_t i, size_t rows, const Image& swatch,
                const std::string& name, const std::string& share) {
  const double column = std::max(panel.width, kLeastPanel) / 2.0;
  const double x = panel.x + double(i / rows) * column, y = top + double(i % rows) * kRow;
  canvas.picture(int(x), int(y), swatch);
  canvas.frame_rect(x, y, swatch.width, swatch.height, 1, kFrame);
  canvas.text(x + 32, y + 13, canvas.fitted(name, column - 110, {.size = 13}), {.size = 13});
  canvas.text(x + column - 18, y + 13, share,
              {.size = 12, .align = Align::right, .color = {0x66, 0x66, 0x66}});
}

// A legend's line as it is drawn.
struct Row {
  Image swatch;
  std::string name, share;
};

template <typename ColorAt>
Image swatch(ColorAt&& color_at) {
  Image image(24, 16, {});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) image.at(x, y) = color_at(x, y);
  return image;
}

// Shares are of the whole picture, gaps included, so that those of a panel add up to 100 %; filled cells are
// counted with their grid as well.
std::vector<Row> legend_rows(const PatchMapInput& in, const std::vector<Entry>& entries, size_t filled) {
  const size_t all = in.kernel_metres.size();
  size_t answering = 0;
  std::vector<Row> rows;
  for (const Entry& e : entries) {
    rows.push_back({swatch([&](int, int) { return e.color; }), e.name, share_text(e.pixels, all)});
    answering += e.pixels;
  }
  if (filled)
    rows.push_back({swatch([](int x, int y) { return striped(class_color(0), x, y); }),
                    "striped: filled, not surveyed", share_text(filled, all)});
  if (answering < all) rows.push_back({swatch(hatch_color), "no data", share_text(all - answering, all)});
  return rows;
}

void draw_rows(Canvas& canvas, const Panel& panel, const std::vector<Row>& rows) {
  const size_t half = (rows.size() + 1) / 2;
  for (size_t i = 0; i < rows.size(); ++i)
    draw_entry(canvas, panel, panel.y + panel.height + 14, i, half, rows[i].swatch, rows[i].name,
               rows[i].share);
}

void draw_panel(Canvas& canvas, const Panel& panel, const std::string& heading, const Image& image) {
  canvas.text(panel.x, panel.y - 9, heading, {.bold = true});
  canvas.picture(panel.x, panel.y, image);
}

void check(const PatchMapInput& in) {
  if (in.width < 1 || in.height < 1) throw Error("patch map", "has no pixels");
  const size_t all = size_t(in.width) * size_t(in.height);
  if (in.kernel_metres.size() != all || in.grid.size() != all ||
      (!in.filled.empty() && in.filled.size() != all))
    throw Error("patch map", "the values are not width x height pixels");
  for (size_t k = 0; k < all; ++k)
    if (answered(in, k) && in.grid[k] >= in.grid_names.size())
      throw Error("patch map", "a pixel's grid has no name");
}

}  // namespace

Image patch_map(const PatchMapInput& in) {
  check(in);
  const SizeLegend sizes = size_legend(in);
  const GridLegend grids = grid_legend(in);
  const std::vector<Row> left_rows = legend_rows(in, sizes.entries, 0);
  const std::vector<Row> right_rows = legend_rows(in, grids.entries, grids.filled);

  const double scale = std::min(double(kPanelWidth) / in.width, double(kPanelHeight) / in.height);
  const Panel left{kMargin, kMargin + kTitle + kHeading, std::max(1, int(std::lround(in.width * scale))),
                   std::max(1, int(std::lround(in.height * scale))), scale};
  const int pitch = std::max(left.width, kLeastPanel) + kGap;
  Panel right = left;
  right.x += pitch;
  const int legend = int(std::max(left_rows.size(), right_rows.size()) + 1) / 2 * kRow + 14;
  const int height = left.y + left.height + legend + (in.step_metres > 0 ? kFoot : 0) + kMargin / 2;

  Canvas canvas(2 * kMargin + 2 * pitch - kGap, height, {0xff, 0xff, 0xff});
  const TextStyle title{.size = 18, .bold = true};
  canvas.text(kMargin, kMargin + 16, canvas.fitted(in.title, 2 * pitch - kGap, title), title);
  draw_panel(canvas, left, "Size of the patch that answers (side of its kernel)",
             panel_image(in, left, [&](size_t k, int, int) {
               return sizes.entries[sizes.of.at(in.kernel_metres[k])].color;
             }));
  draw_outlines(canvas, in, left);
  draw_panel(canvas, right, "Grid that answers", panel_image(in, right, [&](size_t k, int x, int y) {
               const Color c = grids.of[in.grid[k]];
               return is_filled(in, k) ? striped(c, x, y) : c;
             }));
  for (const Panel& p : {left, right})
    canvas.frame_rect(p.x - 1, p.y - 1, p.width + 2, p.height + 2, 1, kFrame);
  draw_rows(canvas, left, left_rows);
  draw_rows(canvas, right, right_rows);
  if (in.step_metres > 0)
    draw_scale_bar(canvas, kMargin, height - kFoot / 2.0 - 4, in.step_metres / scale, 180);
  return canvas.image();
}

}  // namespace patchwork
