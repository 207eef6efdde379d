#include "render/fly_camera.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

#include "tests/seed.h"

namespace patchwork {
namespace {

const Camera kNorth{{500000, 5000000, 800}, {500000, 5001000, 700}, 60, 1280, 720};

double apart(const Point3& a, const Point3& b) { return glm::distance(vec(a), vec(b)); }

// Flies for `seconds` in steps of unequal lengths, about `steps` of them.
void fly(FlyCamera& f, const Steering& s, double seconds, int steps, std::mt19937_64& random) {
  std::uniform_real_distribution<double> part(0.2, 1.8);
  double left = seconds;
  while (left > 0) {
    const double now = std::min(left, part(random) * seconds / steps);
    f.step(s, now);
    left -= now;
  }
}

TEST(FlyCamera, StartsAsTheCameraThatItIsGiven) {
  std::mt19937_64 random(test_seed(1));
  std::uniform_real_distribution<double> metres(-5000, 5000);
  for (int n = 0; n < 100; ++n) {
    const Point3 eye{500000 + metres(random), 5000000 + metres(random), metres(random)};
    const Camera c{eye, {eye.x + metres(random), eye.y + metres(random), eye.z + metres(random) / 10}, 50};
    const FlyCamera f(c, 10);
    const Camera got = f.camera(c.width, c.height);
    EXPECT_NEAR(apart(got.eye, c.eye), 0, 1e-9);
    EXPECT_NEAR(apart(got.look, c.look), 0, 1e-5);
    EXPECT_EQ(got.fov_degrees, 50);
    EXPECT_FALSE(f.moves());
  }
}

TEST(FlyCamera, LookingStraightDownKeepsNorthOnTop) {
  const FlyCamera f({{0, 0, 100}, {0, 0, 0}}, 1);
  const CameraAxes a = axes(f.camera(100, 100));
  EXPECT_NEAR(a.right.x, 1, 1e-9);
  EXPECT_GT(a.up.y, 0.99);
  EXPECT_NEAR(f.pitch(), -FlyCamera::kSteepest * kDegree, 1e-12);
}

TEST(FlyCamera, EachKeyMovesItsOwnWay) {
  const CameraAxes a = axes(kNorth);
  const auto moved = [&](const Steering& s) {
    FlyCamera f(kNorth, 10);
    f.step(s, 1);
    return glm::normalize(vec(f.eye()) - vec(kNorth.eye));
  };
  EXPECT_NEAR(glm::dot(moved({.forward = 1}), a.forward), 1, 1e-9);
  EXPECT_NEAR(glm::dot(moved({.forward = -1}), a.forward), -1, 1e-9);
  EXPECT_NEAR(glm::dot(moved({.right = 1}), a.right), 1, 1e-9);
  EXPECT_NEAR(glm::dot(moved({.up = 1}), glm::dvec3(0, 0, 1)), 1, 1e-9);
}

TEST(FlyCamera, TheWayDoesNotDependOnTheFrameRate) {
  std::mt19937_64 random(test_seed(2));
  const Steering s{.right = 0.5, .forward = 1, .up = -0.3, .fast = true};
  const auto end = [&](int steps) {
    FlyCamera f(kNorth, 10);
    fly(f, s, 2, steps, random), fly(f, {}, 3, steps, random);
    EXPECT_FALSE(f.moves()) << "it has come to rest";
    return f.eye();
  };
  const Point3 once = end(1);
  EXPECT_GT(apart(once, kNorth.eye), 100);
  for (const int steps : {7, 60, 1000}) EXPECT_NEAR(apart(end(steps), once), 0, 1e-6) << steps;
}

TEST(FlyCamera, CurvesConvergeWithTheSquareOfTheStep) {
  const Steering s{.forward = 1, .turn = 1, .tilt = 0.1};
  const auto end = [&](int steps) {
    FlyCamera f(kNorth, 10);
    for (int k = 0; k < steps; ++k) f.step(s, 2.0 / steps);
    return f.eye();
  };
  const Point3 exact = end(20000);
  const double coarse = apart(end(60), exact), fine = apart(end(240), exact);
  EXPECT_LT(coarse, 0.02) << "metres, at 30 frames a second";
  EXPECT_LT(fine, coarse / 10) << "four times as many steps";
}

TEST(FlyCamera, SpeedIsWhatItSays) {
  FlyCamera f(kNorth, 10);
  f.step({.forward = 1}, 5);
  const Point3 before = f.eye();
  f.step({.forward = 1}, 1);
  EXPECT_NEAR(apart(f.eye(), before), 10, 1e-3);
  f.change_speed(2);
  EXPECT_NEAR(f.speed(), 14.4, 1e-9);
  f.step({.forward = 1, .fast = true}, 5);
  const Point3 then = f.eye();
  f.step({.forward = 1, .fast = true}, 1);
  EXPECT_NEAR(apart(f.eye(), then), 72, 1e-2);
}

TEST(FlyCamera, DraggedPointsStayUnderTheMouse) {
  for (const double pixels : {1.0, 40.0}) {
    FlyCamera f({{0, 0, 0}, {0, 1000, 0}, 60, 1280, 720}, 1);
    f.drag(pixels, 0, 720);
    const Seen right = see(f.camera(1280, 720), {0, 1000, 0});
    EXPECT_NEAR(right.x, 640 + pixels, 1e-6);
    EXPECT_NEAR(right.y, 360, 1e-6);
    f.drag(-pixels, pixels, 720);
    EXPECT_NEAR(see(f.camera(1280, 720), {0, 1000, 0}).y, 360 + pixels, 1e-6);
  }
}

TEST(FlyCamera, NeverTurnsOver) {
  FlyCamera f(kNorth, 1);
  f.drag(0, 1e6, 720), f.drag(0, 1e6, 720);
  EXPECT_NEAR(f.pitch(), FlyCamera::kSteepest * kDegree, 1e-12);
  EXPECT_GT(axes(f.camera(10, 10)).up.z, 0);
  f.step({.tilt = -1}, 100);
  EXPECT_NEAR(f.pitch(), -FlyCamera::kSteepest * kDegree, 1e-12);
  EXPECT_GT(axes(f.camera(10, 10)).up.z, 0);
}

TEST(FlyCamera, StaysAboveTheGroundAndGlidesAlongIt) {
  FlyCamera free({{0, 0, 100}, {0, 1000, -900}, 60, 10, 10}, 50), kept = free;
  const auto ground = [](double y) { return 20 + 10 * std::sin(y / 30); };
  double lowest = INFINITY;
  for (int n = 0; n < 600; ++n) {
    free.step({.forward = 1}, 0.02), kept.step({.forward = 1}, 0.02);
    kept.keep_above(ground(kept.eye().y) + 2);
    lowest = std::min(lowest, kept.eye().z - ground(kept.eye().y));
  }
  EXPECT_NEAR(lowest, 2, 1e-9);
  EXPECT_LT(free.eye().z, 0) << "the control";
  EXPECT_NEAR(kept.eye().y, free.eye().y, 1e-6) << "the way in the plane is the same";
  const Point3 before = kept.eye();
  kept.keep_above(-1000);
  EXPECT_EQ(kept.eye().z, before.z);
}

TEST(FlyCamera, ZoomKeepsToItsLimits) {
  FlyCamera f(kNorth, 1);
  f.zoom(1);
  EXPECT_NEAR(f.camera(10, 10).fov_degrees, 54, 1e-9);
  f.zoom(1000);
  EXPECT_EQ(f.camera(10, 10).fov_degrees, FlyCamera::kNarrowest);
  f.zoom(-1000);
  EXPECT_EQ(f.camera(10, 10).fov_degrees, FlyCamera::kWidest);
}

}  // namespace
}  // namespace patchwork
