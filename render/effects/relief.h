// A raster of heights with its pyramid of largest heights: what shadow and sky light look for the horizon in.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "blend/blend.h"

namespace patchwork::effects {

/// Where the samples of a relief lie.
struct ReliefShape {
  Point first;      ///< of sample (0, 0), metres
  double step = 1;  ///< metres
  int width = 2, height = 2;

  /// Over the extent, at most `most` a side.
  static ReliefShape over(const Extent& extent, int most);
  bool operator==(const ReliefShape& o) const {
    return first.x == o.first.x && first.y == o.first.y && step == o.step && width == o.width &&
           height == o.height;
  }
};

/// Sample (i, j) lies at (x0 + i step, y0 + j step); the surface between samples is bilinear. Places without
/// data count as lower than everything.
class Relief {
 public:
  /// `heights` row-major from the south. REQUIRES: at least 2 x 2 of them.
  Relief(Point first, double step, int width, int height, std::vector<float> heights);
  Relief(const ReliefShape& s, std::vector<float> heights)
      : Relief(s.first, s.step, s.width, s.height, std::move(heights)) {}
  /// Samples of `surface` over the extent, at most `most` a side.
  static Relief of(const Evaluator& surface, const Extent& extent, int most);

  ReliefShape shape() const { return {first_, step_, width_, height_}; }
  Point first() const { return first_; }
  double step() const { return step_; }  ///< metres
  int width() const { return width_; }   ///< samples
  int height() const { return height_; }
  /// Metres; without data: kLow.
  std::span<const float> heights() const {
    return {levels_.data(), std::size_t(width_) * std::size_t(height_)};
  }
  double range() const;  ///< metres: from the lowest to the highest with data

  /// Levels of the pyramid of cells: level l has ceil((width - 1) / 2^l) x ceil((height - 1) / 2^l) blocks.
  int top() const { return int(starts_.size()) - 1; }
  /// Heights, then the pyramid's levels, as shaders read them; level l starts at start(l).
  std::span<const float> levels() const { return levels_; }
  std::size_t start(int level) const { return starts_[std::size_t(level)]; }
  int blocks_across(int level) const { return ((width_ - 2) >> level) + 1; }
  float largest(int level, int i, int j) const {
    return levels_[start(level) + std::size_t(j) * std::size_t(blocks_across(level)) + std::size_t(i)];
  }

  /// Tangent of the steepest angle under which the terrain rises in the direction `azimuth` (radians
  /// clockwise from north), seen from sample coordinates (i, j) on the surface: horizon.glsl in double. What
  /// is nearer than kFirst samples does not count: it is the ground's own slope. -1e30 where nothing is.
  double horizon(double i, double j, double azimuth) const;
  static constexpr double kFirst = 1.5;

  /// For each square of `side` cells, row-major: a tangent that no horizon of its samples with data exceeds.
  std::vector<float> steepest(int side) const;

  static constexpr float kLow = -1e5f;  ///< metres: the height of places without data

 private:
  Point first_;
  double step_;
  int width_, height_;
  std::vector<float> levels_;  // the heights, and the pyramid behind them
  std::vector<std::size_t> starts_;
};

}  // namespace patchwork::effects
