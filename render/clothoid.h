// Curves whose curvature changes linearly with their length, and chains of them with continuous curvature.
#pragma once

#include <vector>

#include "db/frame.h"

namespace patchwork {

/// An arc whose curvature goes from `curvature` by `rate` a metre.
struct Clothoid {
  Point start;
  double heading = 0;    ///< radians, counterclockwise from east, at the start
  double curvature = 0;  ///< 1 / metres, at the start; left turns are positive
  double rate = 0;       ///< 1 / metres^2
  double length = 0;     ///< metres

  double heading_at(double s) const { return heading + s * (curvature + 0.5 * s * rate); }
  double curvature_at(double s) const { return curvature + s * rate; }
  Point at(double s) const;

  /// The arc between two points with given headings. REQUIRES: the points differ. Source: Bertolazzi and
  /// Frego, "G1 fitting with clothoids" (2015).
  static Clothoid between(Point a, double heading_a, Point b, double heading_b);
};

/// Arcs through the points, position, heading and curvature continuous; straight at both ends. Source:
/// Bertolazzi and Frego, "Interpolating clothoid splines with curvature continuity" (2018): Newton over the
/// headings at the points. Throws Error: fewer than two points, neighbours that coincide, points through
/// which no such chain was found.
std::vector<Clothoid> clothoids_through(const std::vector<Point>& points);

}  // namespace patchwork
