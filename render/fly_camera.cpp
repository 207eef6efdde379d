#include "render/fly_camera.h"

#include <algorithm>
#include <cassert>
#include <glm/geometric.hpp>

namespace patchwork {

namespace {

constexpr double kSlowest = 0.01, kFastest = 1e6;  // metres a second

double limited_pitch(double radians) {
  return std::clamp(radians, -FlyCamera::kSteepest * kDegree, FlyCamera::kSteepest * kDegree);
}

}  // namespace

FlyCamera::FlyCamera(const Camera& from, double speed)
    : eye_(vec(from.eye)),
      reach_(glm::distance(vec(from.eye), vec(from.look))),
      fov_degrees_(from.fov_degrees),
      speed_(std::clamp(speed, kSlowest, kFastest)) {
  const CameraAxes a = axes(from);
  // Straight down, north is the picture's top: that is where a camera looks that is tilted up again.
  heading_ = std::atan2(a.right.x, -a.right.y);
  pitch_ = limited_pitch(std::asin(std::clamp(a.forward.z, -1.0, 1.0)));
}

glm::dvec3 FlyCamera::forward() const {
  return {std::cos(pitch_) * std::cos(heading_), std::cos(pitch_) * std::sin(heading_), std::sin(pitch_)};
}

void FlyCamera::turn(double left, double up) {
  heading_ = std::remainder(heading_ + left, 360 * kDegree);
  pitch_ = limited_pitch(pitch_ + up);
}

// Half the turn, the way, the other half: of second order in the step where the flight is curved.
// v' = (target - v) / delay, so the way is target t + (v - target) delay (1 - exp(-t / delay)).
void FlyCamera::step(const Steering& s, double seconds) {
  assert(seconds >= 0);
  const double angle = 0.5 * kTurnRate * kDegree * seconds * fov_degrees_ / 60;
  turn(s.turn * angle, s.tilt * angle);
  const glm::dvec3 right(std::sin(heading_), -std::cos(heading_), 0);
  const double fast = speed_ * (s.fast ? kFast : 1);
  const glm::dvec3 target = fast * (s.right * right + s.forward * forward() + s.up * glm::dvec3(0, 0, 1));
  const double kept = std::exp(-seconds / kDelay);
  eye_ += target * seconds + (velocity_ - target) * (kDelay * (1 - kept));
  velocity_ = target + (velocity_ - target) * kept;
  turn(s.turn * angle, s.tilt * angle);
  // The rest of the way that a flight coasts when nobody steers is made at once when it is too short to see.
  if (target == glm::dvec3(0) && glm::length(velocity_) < 1e-3 * speed_)
    eye_ += velocity_ * kDelay, velocity_ = glm::dvec3(0);
}

void FlyCamera::drag(double right, double down, int height) {
  const double gamma = camera(1, height).gamma();
  turn(std::atan(right / gamma) / std::max(std::cos(pitch_), 0.2), std::atan(down / gamma));
}

void FlyCamera::change_speed(double notches) {
  speed_ = std::clamp(speed_ * std::pow(1.2, notches), kSlowest, kFastest);
}

void FlyCamera::zoom(double notches) {
  fov_degrees_ = std::clamp(fov_degrees_ * std::pow(0.9, notches), kNarrowest, kWidest);
}

void FlyCamera::keep_above(double height) {
  if (eye_.z >= height) return;
  eye_.z = height, velocity_.z = std::max(velocity_.z, 0.0);
}

Camera FlyCamera::camera(int width, int height) const {
  return {point(eye_), point(eye_ + reach_ * forward()), fov_degrees_, width, height};
}

}  // namespace patchwork
