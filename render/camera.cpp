#include "render/camera.h"

#include <algorithm>
#include <cassert>
#include <glm/geometric.hpp>

namespace patchwork {

CameraAxes axes(const Camera& c) {
  assert(vec(c.eye) != vec(c.look));
  const glm::dvec3 forward = glm::normalize(vec(c.look) - vec(c.eye));
  const bool steep = std::hypot(forward.x, forward.y) < 1e-9;
  const glm::dvec3 right =
      glm::normalize(glm::cross(forward, steep ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1)));
  return {right, glm::cross(right, forward), forward};
}

namespace {

// The picture's point in units of tangent: right and up of the line of sight.
glm::dvec2 tangents(const Camera& c, double x, double y) {
  return {(x - 0.5 * c.width) / c.gamma(), (0.5 * c.height - y) / c.gamma()};
}

}  // namespace

Ray ray_through(const Camera& c, double x, double y) {
  const CameraAxes a = axes(c);
  const glm::dvec2 t = tangents(c, x, y);
  return {vec(c.eye), glm::normalize(a.forward + t.x * a.right + t.y * a.up)};
}

double axial_share(const Camera& c, double x, double y) {
  const glm::dvec2 t = tangents(c, x, y);
  return 1 / std::sqrt(1 + glm::dot(t, t));
}

Seen see(const Camera& c, const Point3& p) {
  const CameraAxes a = axes(c);
  const glm::dvec3 d = vec(p) - vec(c.eye);
  const double axial = glm::dot(d, a.forward);
  return {0.5 * c.width + c.gamma() * glm::dot(d, a.right) / axial,
          0.5 * c.height - c.gamma() * glm::dot(d, a.up) / axial, glm::length(d), axial};
}

glm::dmat3 view_rotation(const Camera& c) {
  const CameraAxes a = axes(c);
  return glm::transpose(glm::dmat3(a.right, a.up, -a.forward));
}

// depth = near (far - z) / (z (far - near)), near / z for an infinite far plane.
glm::dmat4 projection(const Camera& c, double near, double far) {
  assert(near > 0 && far > near);
  const double f = 1 / c.tan_half();
  const double share = std::isinf(far) ? 0 : near / (far - near);
  glm::dmat4 m(0.0);
  m[0][0] = f * c.height / c.width;
  m[1][1] = -f;
  m[2][2] = share;
  m[3][2] = std::isinf(far) ? near : far * share;
  m[2][3] = -1;
  return m;
}

double axial_of_depth(double depth, double near, double far) {
  if (std::isinf(far)) return near / depth;
  return near * far / (near + depth * (far - near));
}

Camera overview(const Extent& e, double lowest, double highest, double fov_degrees, int width, int height) {
  const glm::dvec3 middle(0.5 * (e.xmin + e.xmax), 0.5 * (e.ymin + e.ymax), 0.5 * (lowest + highest));
  const double radius = 0.5 * std::hypot(e.xmax - e.xmin, e.ymax - e.ymin, highest - lowest);
  const double half = 0.5 * fov_degrees * kDegree;
  const double narrow = std::min(half, std::atan(std::tan(half) * width / height));
  const double away = std::max(radius, 1.0) / std::sin(narrow), rise = 40 * kDegree;
  const glm::dvec3 eye = middle + away * glm::dvec3(0, -std::cos(rise), std::sin(rise));
  return {point(eye), point(middle), fov_degrees, width, height};
}

}  // namespace patchwork
