#include "render/picture.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "db/error.h"

namespace patchwork {
namespace {

// cairo reports most failures only when asked: a surface or context in error draws nothing and stays in
// error, so that one check at the end (`image`) sees them all.

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct ContextDeleter {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;
using Context = std::unique_ptr<cairo_t, ContextDeleter>;

// CAIRO_FORMAT_RGB24: a native 32-bit word a pixel, the upper byte unused.
std::uint32_t packed(Color c) { return std::uint32_t{c.r} << 16 | std::uint32_t{c.g} << 8 | c.b; }
Color unpacked(std::uint32_t v) { return {std::uint8_t(v >> 16), std::uint8_t(v >> 8), std::uint8_t(v)}; }

std::uint32_t* row_of(cairo_surface_t* surface, int y) {
  return reinterpret_cast<std::uint32_t*>(cairo_image_surface_get_data(surface) +
                                          std::ptrdiff_t(y) * cairo_image_surface_get_stride(surface));
}

void check_status(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) throw Error("picture", cairo_status_to_string(status));
}

Surface blank(int width, int height) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  check_status(cairo_surface_status(surface.get()));
  return surface;
}

// Copies `image` into `surface` with its corner at (left, top); what lies outside is cut off.
void blit(const Image& image, cairo_surface_t* surface, int left, int top) {
  cairo_surface_flush(surface);
  const int x0 = std::max(0, -left),
            x1 = std::min(image.width, cairo_image_surface_get_width(surface) - left);
  const int y0 = std::max(0, -top),
            y1 = std::min(image.height, cairo_image_surface_get_height(surface) - top);
  for (int y = y0; y < y1; ++y) {
    std::uint32_t* row = row_of(surface, top + y);
    for (int x = x0; x < x1; ++x) row[left + x] = packed(image.at(x, y));
  }
  cairo_surface_mark_dirty(surface);
}

// Through a stream of ours, so that what fails only when the file is closed is noticed too.
cairo_status_t append(void* stream, const unsigned char* bytes, unsigned length) {
  auto& out = *static_cast<std::ofstream*>(stream);
  out.write(reinterpret_cast<const char*>(bytes), length);
  return out ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

void set_color(cairo_t* context, Color c, double opacity = 1) {
  cairo_set_source_rgba(context, c.r / 255.0, c.g / 255.0, c.b / 255.0, opacity);
}

// The family that fonts-dejavu-core brings; fontconfig falls back to its default sans without it.
void set_font(cairo_t* context, const TextStyle& style) {
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, style.size);
}

// Where a UTF-8 text may be cut: not before a continuation byte.
bool is_boundary(const std::string& text, size_t at) { return (text[at] & 0xc0) != 0x80; }

}  // namespace

struct Canvas::Impl {
  Surface surface;
  Context context;
};

Canvas::Canvas(int width, int height, Color background) : impl_(std::make_unique<Impl>()) {
  impl_->surface = blank(width, height);
  impl_->context.reset(cairo_create(impl_->surface.get()));
  fill_rect(0, 0, width, height, background);
}
Canvas::Canvas(Canvas&&) noexcept = default;
Canvas::~Canvas() = default;

void Canvas::picture(int x, int y, const Image& image) { blit(image, impl_->surface.get(), x, y); }

void Canvas::fill_rect(double x, double y, double width, double height, Color color) {
  set_color(impl_->context.get(), color);
  cairo_rectangle(impl_->context.get(), x, y, width, height);
  cairo_fill(impl_->context.get());
}

void Canvas::frame_rect(double x, double y, double width, double height, double line, Color color) {
  set_color(impl_->context.get(), color);
  cairo_set_line_width(impl_->context.get(), line);
  // cairo's line runs along both sides of its path.
  cairo_rectangle(impl_->context.get(), x + line / 2, y + line / 2, width - line, height - line);
  cairo_stroke(impl_->context.get());
}

void Canvas::line(Point a, Point b, double width, Color color) {
  set_color(impl_->context.get(), color);
  cairo_set_line_width(impl_->context.get(), width);
  cairo_move_to(impl_->context.get(), a.x, a.y);
  cairo_line_to(impl_->context.get(), b.x, b.y);
  cairo_stroke(impl_->context.get());
}

void Canvas::outline(std::span<const Point> corners, double width, Color color, double opacity,
                     const Extent& clip) {
  cairo_t* context = impl_->context.get();
  cairo_save(context);
  cairo_rectangle(context, clip.xmin, clip.ymin, clip.xmax - clip.xmin, clip.ymax - clip.ymin);
  cairo_clip(context);
  set_color(context, color, opacity);
  cairo_set_line_width(context, width);
  for (const Point& p : corners) cairo_line_to(context, p.x, p.y);
  cairo_close_path(context);
  cairo_stroke(context);
  cairo_restore(context);
}

void Canvas::text(double x, double y, const std::string& text, const TextStyle& style) {
  const double shift = style.align == Align::left ? 0 : style.align == Align::centre ? 0.5 : 1;
  // By the advance and not by the ink, so that right-aligned columns of numbers keep their digits in line.
  const double left = x - shift * text_width(text, style);
  set_font(impl_->context.get(), style);
  set_color(impl_->context.get(), style.color);
  cairo_move_to(impl_->context.get(), left, y);
  cairo_show_text(impl_->context.get(), text.c_str());
}

double Canvas::text_width(const std::string& text, const TextStyle& style) const {
  set_font(impl_->context.get(), style);
  cairo_text_extents_t extents;
  cairo_text_extents(impl_->context.get(), text.c_str(), &extents);
  return extents.x_advance;
}

std::string Canvas::fitted(const std::string& text, double width, const TextStyle& style) const {
  if (text_width(text, style) <= width) return text;
  size_t length = text.size();
  std::string cut;
  do {
    do --length;
    while (length > 0 && !is_boundary(text, length));
    cut = text.substr(0, length) + "…";
  } while (length > 0 && text_width(cut, style) > width);
  return cut;
}

Image Canvas::image() const {
  cairo_surface_t* surface = impl_->surface.get();
  check_status(cairo_status(impl_->context.get()));
  cairo_surface_flush(surface);
  Image image(cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface), {});
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) image.at(x, y) = unpacked(row_of(surface, y)[x]);
  return image;
}

void write_png(const std::string& path, const Image& image) {
  if (image.width < 1 || image.height < 1) throw Error(path, "the picture has no pixels");
  const Surface surface = blank(image.width, image.height);
  blit(image, surface.get(), 0, 0);
  std::ofstream out(path, std::ios::binary);
  if (!out) throw Error(path, "cannot be opened for writing", "check the folder and its permissions");
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface.get(), append, &out);
  out.close();
  if (status == CAIRO_STATUS_SUCCESS && out) return;
  // Half a picture would look like a whole one to the next program.
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  throw Error(path, "cannot be written in full", "is the disk full?");
}

Color hatch_color(int x, int y) {
  return (x + y) % 8 < 2 ? Color{0xc4, 0xc4, 0xc4} : Color{0xea, 0xea, 0xea};
}

double round_down_125(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  // The logarithm may round up to a power just above the value.
  for (double m : {5.0, 2.0, 1.0})
    if (m * power <= value) return m * power;
  return power / 2;
}

std::string length_text(double metres) {
  char text[32];
  const bool km = metres >= 1000;
  std::snprintf(text, sizeof text, "%.3g %s", km ? metres / 1000 : metres, km ? "km" : "m");
  return text;
}

void draw_scale_bar(Canvas& canvas, double x, double y, double metres_per_pixel, double most) {
  const Color ink{0x33, 0x33, 0x33};
  const double metres = round_down_125(most * metres_per_pixel), length = metres / metres_per_pixel;
  canvas.fill_rect(x, y - 2, length, 4, ink);
  for (double end : {x, x + length - 2}) canvas.fill_rect(end, y - 7, 2, 14, ink);
  canvas.text(x + length + 8, y + 5, length_text(metres), {.size = 13});
}

}  // namespace patchwork
