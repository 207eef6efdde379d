// A picture in memory, drawing on it, and PNG.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "db/frame.h"

namespace patchwork {

/// sRGB, 8 bits a channel.
struct Color {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Color&) const = default;
};

/// Pixels row-major from the top left, opaque.
struct Image {
  int width = 0, height = 0;
  std::vector<Color> pixels;

  Image() = default;
  Image(int w, int h, Color fill) : width(w), height(h), pixels(size_t(w) * size_t(h), fill) {}
  Color& at(int x, int y) { return pixels[size_t(y) * size_t(width) + size_t(x)]; }
  const Color& at(int x, int y) const { return pixels[size_t(y) * size_t(width) + size_t(x)]; }
};

/// Writes an 8-bit RGB PNG. Throws Error(path, ...): an empty image, a file that cannot be written in full.
void write_png(const std::string& path, const Image& image);

enum class Align { left, centre, right };

struct TextStyle {
  double size = 14;  ///< pixels
  bool bold = false;
  Align align = Align::left;
  Color color{0x22, 0x22, 0x22};
};

/// An image under construction. Coordinates are pixels, (0, 0) the outer corner of the top left pixel.
class Canvas {
 public:
  Canvas(int width, int height, Color background);
  Canvas(Canvas&&) noexcept;
  ~Canvas();

  /// `image` unscaled, its top left corner at whole pixel (x, y).
  void picture(int x, int y, const Image& image);
  void fill_rect(double x, double y, double width, double height, Color color);
  /// The line lies inside the rectangle.
  void frame_rect(double x, double y, double width, double height, double line, Color color);
  void line(Point a, Point b, double width, Color color);
  /// Closed outline, clipped to the rectangle {x, y, x + width, y + height}. `opacity` 0 to 1.
  void outline(std::span<const Point> corners, double width, Color color, double opacity, const Extent& clip);
  /// `y` is the baseline.
  void text(double x, double y, const std::string& text, const TextStyle& style = {});
  /// Pixels that the text takes.
  double text_width(const std::string& text, const TextStyle& style = {}) const;
  /// The text itself, or its beginning and "…" where it is wider than `width` pixels.
  std::string fitted(const std::string& text, double width, const TextStyle& style = {}) const;
  /// The finished picture.
  Image image() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The look of places without data: pale grey with darker diagonals.
Color hatch_color(int x, int y);

/// The largest of 1, 2, 5 times a power of ten that is not above `value` (> 0).
double round_down_125(double value);

/// A length for people: "250 m", "1.5 km".
std::string length_text(double metres);

/// A bar of round length for a map of `metres_per_pixel`, at most `most` pixels long, its left end at (x, y).
void draw_scale_bar(Canvas& canvas, double x, double y, double metres_per_pixel, double most);

}  // namespace patchwork
