// A camera that a person steers: flies along its line of sight, turns without roll.
#pragma once

#include "render/camera.h"

namespace patchwork {

/// What is held down during a step, each from -1 to 1.
struct Steering {
  double right = 0, forward = 0, up = 0;  ///< of the line of sight; up is the domain's
  double turn = 0, tilt = 0;              ///< to the left, upwards
  bool fast = false;
  bool operator==(const Steering&) const = default;
};

/// Where it flies to depends on how long it is steered how, and not on how many steps that time is cut into.
/// Velocity follows what is steered with a delay of kDelay, so that a flight starts and ends softly; the
/// way is integrated exactly for it.
class FlyCamera {
 public:
  static constexpr double kDelay = 0.12;                  ///< seconds, of an exponential
  static constexpr double kSteepest = 89;                 ///< degrees above and below the horizon
  static constexpr double kTurnRate = 60;                 ///< degrees a second, at 60 degrees of view
  static constexpr double kFast = 5;                      ///< times the speed
  static constexpr double kWidest = 120, kNarrowest = 1;  ///< degrees, vertical

  /// Starts at rest. `speed`: metres a second, above 0.
  FlyCamera(const Camera& from, double speed);

  void step(const Steering& steering, double seconds);
  /// The picture is dragged by so many pixels: what is in its middle stays under the mouse (for small drags).
  void drag(double right, double down, int height);
  /// Notches of a wheel: a fifth faster each, or a tenth narrower.
  void change_speed(double notches);
  void zoom(double notches);
  /// Lifts the eye where it is lower than `height`, metres; it sinks no more then.
  void keep_above(double height);

  Camera camera(int width, int height) const;
  Point3 eye() const { return point(eye_); }
  double speed() const { return speed_; }      ///< metres a second
  double heading() const { return heading_; }  ///< radians, counterclockwise from east
  double pitch() const { return pitch_; }      ///< radians above the horizon
  bool moves() const { return velocity_ != glm::dvec3(0); }

 private:
  glm::dvec3 forward() const;
  void turn(double left, double up);

  glm::dvec3 eye_, velocity_{0};
  double heading_, pitch_;
  double reach_;  // metres from the eye to the point that is looked at
  double fov_degrees_, speed_;
};

}  // namespace patchwork
