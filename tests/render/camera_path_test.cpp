#include "render/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

double apart(double a, double b) { return std::abs(std::remainder(a - b, 2 * std::numbers::pi)); }

// A way whose legs turn by at most `turn` radians.
std::vector<Point> random_way(std::mt19937_64& random, int points, double turn) {
  std::uniform_real_distribution<double> by(-turn, turn), leg(100, 3000), any(-3, 3);
  std::vector<Point> way{{500000, 5000000}};
  double heading = any(random);
  for (int k = 1; k < points; ++k, heading += by(random)) {
    const double l = leg(random);
    way.push_back({way.back().x + l * std::cos(heading), way.back().y + l * std::sin(heading)});
  }
  return way;
}

TEST(Clothoid, MeetsBothPointsWithBothHeadings) {
  std::mt19937_64 random(test_seed(1));
  std::uniform_real_distribution<double> at(-1000, 1000), angle(-3, 3);
  for (int n = 0; n < 1000; ++n) {
    const Point a{at(random), at(random)}, b{at(random), at(random)};
    const double chord = std::atan2(b.y - a.y, b.x - a.x);
    const double from = chord + angle(random), to = chord + angle(random);
    const Clothoid c = Clothoid::between(a, from, b, to);
    ASSERT_GT(c.length, 0);
    const Point end = c.at(c.length);
    EXPECT_NEAR(end.x, b.x, 1e-7) << from - chord << ' ' << to - chord;
    EXPECT_NEAR(end.y, b.y, 1e-7);
    EXPECT_LT(apart(c.heading_at(c.length), to), 1e-9);
  }
}

TEST(Clothoid, AnArcOfConstantCurvatureIsACircle) {
  const Clothoid c = Clothoid::between({0, 0}, 0, {100, 100}, std::numbers::pi / 2);
  EXPECT_NEAR(c.curvature, 0.01, 1e-12);
  EXPECT_NEAR(c.rate, 0, 1e-14);
  EXPECT_NEAR(c.length, 50 * std::numbers::pi, 1e-9);
}

TEST(Clothoid, ChainsKeepPositionHeadingAndCurvature) {
  std::mt19937_64 random(test_seed(2));
  for (int n = 0; n < 300; ++n) {
    const std::vector<Point> way = random_way(random, 3 + n % 20, 2.2);
    const std::vector<Clothoid> arcs = clothoids_through(way);
    ASSERT_EQ(arcs.size(), way.size() - 1);
    for (std::size_t k = 0; k < arcs.size(); ++k) {
      const Point end = arcs[k].at(arcs[k].length);
      EXPECT_NEAR(end.x, way[k + 1].x, 1e-5);
      EXPECT_NEAR(end.y, way[k + 1].y, 1e-5);
      const double bend = arcs[k].curvature_at(arcs[k].length) * arcs[k].length;
      if (k + 1 == arcs.size()) {
        EXPECT_NEAR(bend, 0, 1e-8) << "straight at the end";
        continue;
      }
      EXPECT_LT(apart(arcs[k].heading_at(arcs[k].length), arcs[k + 1].heading), 1e-8);
      EXPECT_NEAR(bend, arcs[k + 1].curvature * arcs[k].length, 1e-6);
    }
    EXPECT_NEAR(arcs[0].curvature * arcs[0].length, 0, 1e-8) << "straight at the start";
  }
}

// The control: arcs fitted with the first guess alone jump.
TEST(Clothoid, HeadingsOfCirclesThroughThreePointsWouldJump) {
  const std::vector<Point> way{{0, 0}, {1000, 0}, {1000, 1000}, {3000, 1000}};
  const double quarter = std::numbers::pi / 4;
  const Clothoid a = Clothoid::between(way[0], -0.5 * quarter, way[1], quarter);
  const Clothoid b = Clothoid::between(way[1], quarter, way[2], 1.4 * quarter);
  EXPECT_GT(std::abs(a.curvature_at(a.length) - b.curvature) * a.length, 0.1);
}

Flight flight(std::vector<Point3> points) {
  Flight f;
  f.points = std::move(points);
  return f;
}

const Flight kTurns = flight({{0, 0, 500}, {2000, 300, 900}, {3500, 2500, 900}, {1000, 4000, 700}});

TEST(CameraPath, FramesAreEquallyFarApartOverGround) {
  Flight f = kTurns;
  f.speed = 60, f.frames_per_second = 30;
  const CameraPath path(f);
  ASSERT_EQ(path.frames(), 1 + int(path.length() / 2));
  for (int k = 1; k < path.frames(); ++k) {
    // The chord of 2 m is shorter than the arc by curvature^2 * 8 / 24.
    const Point3 a = path.frame(k - 1, 64, 36).eye, b = path.frame(k, 64, 36).eye;
    EXPECT_NEAR(std::hypot(b.x - a.x, b.y - a.y), 2, 1e-5);
  }
}

TEST(CameraPath, SoManyFramesAsAskedForFromTheFirstPointToTheLast) {
  Flight f = kTurns;
  f.frames = 7;
  const CameraPath path(f);
  EXPECT_EQ(path.frames(), 7);
  EXPECT_NEAR(path.frame(0, 64, 36).eye.x, 0, 1e-6);
  EXPECT_NEAR(path.frame(6, 64, 36).eye.x, 1000, 1e-4);
  EXPECT_NEAR(path.frame(6, 64, 36).eye.z, 700, 1e-9);
  f.frames = 1;
  EXPECT_EQ(CameraPath(f).distance_of(0), 0);
}

TEST(CameraPath, PassesItsPointsAndNeverOvershootsTheirHeights) {
  const CameraPath path(kTurns);
  int next = 0;
  for (double s = 0; s <= path.length(); s += 0.5) {
    const Point3 e = path.eye(s), &p = kTurns.points[size_t(next)];
    if (std::hypot(e.x - p.x, e.y - p.y) < 0.5) {
      EXPECT_NEAR(e.z, p.z, 0.5);
      if (++next == 4) break;
    }
    EXPECT_GE(e.z, 500 - 1e-9);
    EXPECT_LE(e.z, 900 + 1e-9);
  }
  EXPECT_EQ(next, 4);
}

// Between frames the heading changes by curvature * distance, and the curvature itself continuously.
TEST(CameraPath, HeadingAndCurvatureAreContinuous) {
  const CameraPath path(kTurns);
  const double ds = 0.25;
  double most_rate = 0;
  for (double s = 0; s + ds < path.length(); s += ds) {
    const double turned = path.heading(s + ds) - path.heading(s);
    EXPECT_LT(apart(turned, 0.5 * ds * (path.curvature(s) + path.curvature(s + ds))), 1e-8);
    most_rate = std::max(most_rate, std::abs(path.curvature(s + ds) - path.curvature(s)) / ds);
  }
  EXPECT_LT(most_rate, 1e-5) << "a jump of 1 / km would be 4e-3";
}

TEST(CameraPath, LooksAlongTheWayOrAtItsTarget) {
  Flight f = flight({{0, 0, 500}, {1000, 0, 500}});
  f.pitch = -30;
  const Camera along = CameraPath(f).at(200, 64, 36);
  EXPECT_NEAR(along.look.y, 0, 1e-9);
  EXPECT_NEAR(std::atan2(along.look.z - 500, along.look.x - 200), -30 * kDegree, 1e-12);
  f.targets = {{500, 500, 0}};
  EXPECT_EQ(CameraPath(f).at(200, 64, 36).look.y, 500);
  f.targets = {{500, 500, 0}, {900, 500, 0}};
  EXPECT_NEAR(CameraPath(f).at(500, 64, 36).look.x, 700, 1e-9);
  f.targets = {{200, 0, 500}};  // on the way itself
  EXPECT_NEAR(CameraPath(f).at(200, 64, 36).look.y, 0, 1e-9);
}

TEST(CameraPath, RefusesMoreFramesThanAnyoneDraws) {
  Flight flight{.points = {{0, 0, 9}, {100000, 0, 9}}, .targets = {}, .frames = {}};
  EXPECT_EQ(refusal_of([&] { CameraPath{flight}; }), "") << "negative control";
  flight.speed = 0.001;
  EXPECT_NE(refusal_of([&] { CameraPath{flight}; }).find("fly faster"), std::string::npos);
}

TEST(CameraPath, RefusesPointsThatMakeNoWay) {
  EXPECT_NE(refusal_of([] { clothoids_through({{0, 0}}); }).find("at least two"), std::string::npos);
  EXPECT_NE(refusal_of([] {
              clothoids_through({{0, 0}, {1, 1}, {1, 1}});
            }).find("points 1 and 2"),
            std::string::npos);
  const std::vector<Point> jagged{{978, 494}, {381, 214}, {32, 78}, {814, 255}, {349, 364}, {652, 544}};
  EXPECT_NE(refusal_of([&] { clothoids_through(jagged); }).find("add points where it turns sharply"),
            std::string::npos);
}

}  // namespace
}  // namespace patchwork
