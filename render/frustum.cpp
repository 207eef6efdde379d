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
    : eye_(camera.eye), curvature_(curvature), far_(far), gamma_(camera.gamma()) {
  const CameraAxes a = axes(camera);
  const double ty = camera.tan_half(), tx = ty * camera.width / camera.height;
  axis_ = numbers(a.forward), right_ = numbers(a.right), up_ = numbers(a.up), wide_ = tx, high_ = ty;
  sides_ = {numbers(glm::normalize(tx * a.forward + a.right)),
            numbers(glm::normalize(tx * a.forward - a.right)), numbers(glm::normalize(ty * a.forward + a.up)),
            numbers(glm::normalize(ty * a.forward - a.up))};
}

// Over the part of the picture where the box may be; convex there, so largest in a corner. REQUIRES: all of
// the box is ahead. blocks.glsl does the same.
double Frustum::stretch_in(const Box3& b) const {
  double x[2] = {INFINITY, -INFINITY}, y[2] = {INFINITY, -INFINITY};
  for (int k = 0; k < 8; ++k) {
    const double p[3] = {k & 1 ? b.place.xmax : b.place.xmin, k & 2 ? b.place.ymax : b.place.ymin,
                         k & 4 ? b.highest : b.lowest};
    const auto along = [&](const std::array<double, 3>& n) {
      return n[0] * p[0] + n[1] * p[1] + n[2] * p[2];
    };
    const double depth = along(axis_), tx = along(right_) / depth, ty = along(up_) / depth;
    x[0] = std::min(x[0], tx), x[1] = std::max(x[1], tx);
    y[0] = std::min(y[0], ty), y[1] = std::max(y[1], ty);
  }
  double most = 0;
  for (const double tx : x)
    for (const double ty : y)
      most = std::max(
          most, stretch(std::clamp(tx, -wide_, wide_), std::clamp(ty, -high_, high_), up_[2], axis_[2]));
  return most;
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
  const Box3 b = bent(box);
  const double nearest = -largest_along(opposite(axis_), b);
  return nearest > 0 ? gamma_ * stretch_in(b) / nearest : std::numeric_limits<double>::infinity();
}

}  // namespace patchwork
