// The one definition of what a pixel sees: the tiles' cut, the shaders, the ray-caster and the tests share
// it.
//
// Domain: x east, y north, z up, metres, double. View space: x right, y up, z towards the viewer (the eye
// looks along -z), origin in the eye. Clip space is Vulkan's: x right, y down, depth 1 at the near plane and
// 0 at the far plane or at infinity (reversed, which float32 keeps exact far away).
//
//     clip = projection(c, near, far) * view_rotation(c) * vec4(position - eye, 1)
//
// `position - eye` is computed in double, the rest may be float32. Pixel (0, 0) is the top left one; its
// centre lies at (0.5, 0.5).
#pragma once

#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numbers>

#include "db/frame.h"
#include "db/point3.h"

namespace patchwork {

inline constexpr double kDegree = std::numbers::pi / 180;  ///< radians

inline glm::dvec3 vec(const Point3& p) { return {p.x, p.y, p.z}; }
inline Point3 point(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// A pinhole camera without roll. REQUIRES: eye and look differ; 0 < fov_degrees < 180; a size of at least
/// 1 x 1.
struct Camera {
  Point3 eye, look;                ///< metres; `look` is the point in the middle of the picture
  double fov_degrees = 60;         ///< vertical
  int width = 1280, height = 720;  ///< pixels

  /// tan of half the vertical angle.
  double tan_half() const { return std::tan(0.5 * fov_degrees * kDegree); }
  /// Pixels per unit of tangent: a length of 1 m, 1 m ahead, across the line of sight (gamma of ViewCut).
  double gamma() const { return height / (2 * tan_half()); }
};

/// The camera's axes in the domain, orthonormal: right is level; looking straight up or down, north is the
/// picture's top, as in footprint() of query/cut.h.
struct CameraAxes {
  glm::dvec3 right, up, forward;
};
CameraAxes axes(const Camera& camera);

/// A straight line of sight: eye + t * direction, |direction| = 1, t in metres.
struct Ray {
  glm::dvec3 origin, direction;
  glm::dvec3 at(double t) const { return origin + t * direction; }
};
/// Through the point (x, y) of the picture, in pixels.
Ray ray_through(const Camera& camera, double x, double y);
/// Through the centre of pixel (column, row).
inline Ray ray(const Camera& camera, int column, int row) {
  return ray_through(camera, column + 0.5, row + 0.5);
}

/// The cosine between the ray through (x, y) and the line of sight: distance along the axis = distance along
/// the ray * this. Depth pictures hold the distance along the ray.
double axial_share(const Camera& camera, double x, double y);

/// Where a point is seen.
struct Seen {
  double x = 0, y = 0;  ///< pixels
  double distance = 0;  ///< metres along the ray
  double axial = 0;     ///< metres along the line of sight; not above 0: behind the eye, x and y mean nothing
};
Seen see(const Camera& camera, const Point3& p);

/// Domain directions to view space; apply to position - eye.
glm::dmat3 view_rotation(const Camera& camera);
/// View space to clip space. `near` > 0 metres; `far` may be infinite.
glm::dmat4 projection(const Camera& camera, double near,
                      double far = std::numeric_limits<double>::infinity());
/// Metres along the line of sight of a depth that projection(camera, near, far) gave.
double axial_of_depth(double depth, double near, double far = std::numeric_limits<double>::infinity());

/// A camera that sees all of a terrain from the south, 40 degrees above the horizon.
Camera overview(const Extent& extent, double lowest, double highest, double fov_degrees, int width,
                int height);

}  // namespace patchwork
