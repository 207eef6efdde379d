// Where a question is asked: everywhere, in an upright rectangle, or in a polygon.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "db/grid.h"

namespace patchwork {

/// A closed region of the domain. Copies are cheap enough to pass by value.
class Region {
 public:
  Region() = default;  ///< everywhere
  static Region inside(const Extent& extent);
  /// A simple polygon by its corners, in either turn. Throws Error: fewer than three corners, not finite.
  static Region inside(const std::vector<Point>& corners);
  /// Reads "x y, x y, ..." or "POLYGON((x y, ...))". Throws Error.
  static Region parse_polygon(const std::string& text);

  const Extent& bounds() const { return bounds_; }
  bool contains(Point p) const;  ///< either way on a polygon's rim
  /// Does the domain of a patch meet the region?
  bool meets(const Grid& grid, const GridShape::Block& block) const;

 private:
  struct Outline;
  Extent bounds_{-1e300, -1e300, 1e300, 1e300};
  std::shared_ptr<const Outline> outline_;  // of a polygon; none for a rectangle
};

/// Reads "x y, x y, ..." or WKT of one ring or line, whose heights do not matter. Throws Error(what, ...).
std::vector<Point> parse_points(const std::string& what, const std::string& text);

}  // namespace patchwork
