// Which boxes of an R-tree page a view meets (used by cut_view.cpp).
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "db/lod_page.h"

namespace patchwork {

/// A view as a question to pages: the squared tolerance is slope^2 times the squared distance to an eye, over
/// a convex region.
struct PageView {
  /// footprint() makes 21 points at most, the pyramid's 5 ends and two on each of its 8 edges; rounded, and
  /// all nearly on one line, each may be a corner of either side of their hull.
  static constexpr std::size_t kMostSides = 40;

  /// `corners` of the region, counterclockwise, each different from the next; fewer than three: nothing is
  /// seen. Throws std::length_error beyond kMostSides.
  PageView(Point eye, double above, double slope, std::span<const Point> corners);
  bool beyond(std::size_t side, Point p) const { return nx[side] * p.x + ny[side] * p.y > most[side]; }

  /// Never too few: boxes are compared as floats, with what floats lose allowed for. `inside`: all of the
  /// page's boxes lie in the region.
  LodHits hits(const LodPage& page, bool inside) const { return hits_(page, *this, inside); }

  Point eye;
  double above, slope;  ///< metres from the eye to the plane; metres of tolerance a metre of distance
  float k_near, k_far, height2;    ///< slope^2, less a little and more a little; above^2
  float west, south, east, north;  ///< bounds of the region, metres from the eye
  /// Metres: from the eye to the furthest corner (along x and y together) or to the plane; how far floats can
  /// tell; what coordinates may have lost, as if it were a length that floats lose of.
  double reach, most_reach, unsure;
  /// Inside are the points with nx x + ny y <= most; |(nx, ny)| = 1. Those behind `sides` hold every point.
  /// What is positive of a normal stands apart from what is negative, so that a box's innermost and outermost
  /// corner need no choice.
  std::size_t sides = 0;
  std::array<double, kMostSides> nx{}, ny{}, most;
  std::array<float, kMostSides> from_eye;  ///< `most`, for points relative to the eye
  std::array<float, kMostSides> nx_up{}, nx_down{}, ny_up{}, ny_down{};

 private:
  void add_side(Point a, Point b);  // REQUIRES: a != b

  LodHits (*hits_)(const LodPage&, const PageView&, bool) = [](const LodPage&, const PageView&, bool) {
    return LodHits();
  };
};

}  // namespace patchwork
