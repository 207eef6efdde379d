// Surfaces e(x, y) that cut LOD space: how much error a place may have (design: model, section 5).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "db/database.h"
#include "db/point3.h"
#include "query/region.h"

namespace patchwork {

/// The smallest and the largest tolerance over a rectangle, metres.
struct ToleranceRange {
  double low = 0, high = 0;
};

/// A tolerance over a region. Ranges are exact over whole rectangles, never clipped to a tile: a patch is in
/// or out for all tiles alike. Safe for concurrent use.
class CutSurface {
 public:
  virtual ~CutSurface() = default;
  virtual double at(Point p) const = 0;  ///< metres
  virtual ToleranceRange over(const Frame& frame, const LatticeRect& rect) const = 0;
  virtual bool meets(const Grid& grid, const GridShape::Block& block) const = 0;  ///< its domain the region
  /// The boxes of a page that can belong to the answer, never too few; `inside`: the page's box was said to
  /// lie in the region. No allocation.
  virtual LodHits hits(const LodPage& page, bool inside) const = 0;
};

/// A uniform cut: e(x, y) = error over the region.
struct UniformCut {
  double error = 0;  ///< metres; 0 means the best there is
  Region region = {};
  bool strict =
      false;  ///< only patches with bottom <= error; else, where that is not available, the best there is
};

/// A view: e(x, y) = pixel_error * distance to the eye in the plane / gamma, gamma = height / (2 tan(fov /
/// 2)); so that an error is seen under at most that many pixels (the plane's distance is never the larger
/// one). The region is the part of the plane over which the view's pyramid meets heights [lowest, highest].
struct ViewCut {
  Point3 eye, look;                ///< metres; `look` is the point in the middle of the picture
  double fov_degrees = 60;         ///< vertical
  int width = 1280, height = 720;  ///< pixels
  double pixel_error = 1;          ///< pixels
  double far = 0;                  ///< metres along the line of sight; REQUIRES: > 0
  /// Metres: of all grids' surfaces at level 0. A coarser patch is farther out by its error at most, which is
  /// seen under `pixel_error`.
  double lowest = 0, highest = 0;
  /// The distance in space instead, to the nearest height in [lowest, highest]: fewer patches for an eye high
  /// above, and the error is still seen under at most `pixel_error`, because no terrain is nearer than that.
  bool in_space = false;
  bool strict = false;
};

/// A polyline that needs more accuracy than its surroundings: `error` within `width` of it, `outside` beyond
/// width + ramp, linear between.
struct CorridorCut {
  std::vector<Point> line;
  double error = 0, outside = 0, width = 0, ramp = 0;  ///< metres
  Region region = {};
  bool strict = false;
};

/// A raster of tolerances, metres: pixel (i, j) speaks for the square around frame.to_domain(i, j); NaN and
/// what lies beyond the raster mean `outside`.
struct FieldCut {
  Frame frame = {};
  int width = 0, height = 0;
  std::vector<float> tolerance;  ///< row-major, width x height
  double outside = 0;
  Region region = {};
  bool strict = false;
};

/// Throw Error: a number that is none or negative; a view without extent, with lengths or pixels beyond 1e100
/// or an eye within 1e-100 m of what it looks at; a line of less than two points, a field that is not width x
/// height.
std::unique_ptr<CutSurface> make_surface(const UniformCut& cut);
std::unique_ptr<CutSurface> make_surface(const ViewCut& cut);
std::unique_ptr<CutSurface> make_surface(const CorridorCut& cut);
std::unique_ptr<CutSurface> make_surface(const FieldCut& cut);

/// The same view with `far`, `lowest` and `highest` such that it sees all that the database holds.
ViewCut over_terrain_of(const Database& db, ViewCut cut);

/// The corners of a view's region, counterclockwise; fewer than three where it sees nothing. Throws as
/// make_surface does.
std::vector<Point> footprint(const ViewCut& cut);
/// True in the region that has these corners, and on its rim.
bool sees(std::span<const Point> footprint, Point p);

}  // namespace patchwork
