#include "render/frustum.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace patchwork {

namespace {

std::array<double, 3> numbers(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

// The largest of n * (corner - eye) over the corners of a box that is relative to the eye.
double largest_along(const std::array<double, 3>& n, const Box3& b) {
  return n[0] * (n[0] > 0 ? b.place.xmax : b.place.xmin) + n[1] * (n[1] > 0 ? b.place.ymax : b.place.ymin) +
         n[2] * (n[2] > 0 ? b.highest : b.lowest);
}

std::array<double, 3> opposite(const std::array<double, 3>& n) { return {-n[0], -n[1], -n[2]}; }

// What a metre up is on the screen at depth 1, in tangents, where the screen has tangents (x, y):
// d(X / Z, Y / Z) for a step (0, up, ahead) of view space.
double stretch(double x, double y, double up, double ahead) { return std::hypot(x * ahead, up - y * ahead); }

}  // namespace

Frustum::Frustum(const Camera& camera, double curvature, double far)
    : eye_(camera.eye), curvature_(curvature), far_(far) {
  const CameraAxes a = axes(camera);
  const double ty = camera.tan_half(), tx = ty * camera.width / camera.height;
  axis_ = numbers(a.forward);
  sides_ = {numbers(glm::normalize(tx * a.forward + a.right)),
            numbers(glm::normalize(tx * a.forward - a.right)), numbers(glm::normalize(ty * a.forward + a.up)),
            numbers(glm::normalize(ty * a.forward - a.up))};
  // Convex over the screen: largest in a corner.
  double most = 0;
  for (const double x : {-tx, tx})
    for (const double y : {-ty, ty}) most = std::max(most, stretch(x, y, a.up.z, a.forward.z));
  gamma_ = camera.gamma() * most;
}

// Relative to the eye, and lowered by the earth's curvature.
Box3 Frustum::bent(const Box3& b) const {
  Box3 r{{b.place.xmin - eye_.x, b.place.ymin - eye_.y, b.place.xmax - eye_.x, b.place.ymax - eye_.y},
         b.lowest - eye_.z,
         b.highest - eye_.z};
  if (curvature_ == 0) return r;
  const auto far = [](double a, double c) { return std::max(std::abs(a), std::abs(c)); };
  const auto near = [](double a, double c) { return a > 0 ? a : c < 0 ? -c : 0; };
  const double fx = far(r.place.xmin, r.place.xmax), fy = far(r.place.ymin, r.place.ymax);
  const double nx = near(r.place.xmin, r.place.xmax), ny = near(r.place.ymin, r.place.ymax);
  r.lowest -= curvature_ * (fx * fx + fy * fy), r.highest -= curvature_ * (nx * nx + ny * ny);
  return r;
}

bool Frustum::sees(const Box3& box) const {
  const Box3 b = bent(box);
  for (const auto& n : sides_)
    if (largest_along(n, b) < 0) return false;
  return largest_along(axis_, b) > 0 && -largest_along(opposite(axis_), b) <= far_;
}

double Frustum::pixels_per_metre(const Box3& box) const {
  const double nearest = -largest_along(opposite(axis_), bent(box));
  return nearest > 0 ? gamma_ / nearest : std::numeric_limits<double>::infinity();
}

}  // namespace patchwork
