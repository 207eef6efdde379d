#include "blend/profile.h"

#include <gtest/gtest.h>

#include "tests/blend/scene.h"

namespace patchwork {
namespace {

// A roof along x: 0 at both ends, 30 m in the middle, on cells of 10 m; x from 0 to 600.
Land roof() {
  GridFile g{.width = 61,
             .height = 21,
             .geotransform = {-5, 10, 0, 205, 0, -10},
             .pixel_is_area = false,
             .accuracy = 0.5};
  g.at = [](int i, int) { return 30.0 - std::abs(i - 30); };
  return Land({g});
}

class ProfileOfARoof : public ::testing::Test {
 protected:
  ProfileOfARoof() : land_(roof()), blend_(land_.db(), extract(land_.db(), {.error = 0}).patches, {}) {}
  Profile along(std::vector<Point> line, double step) const { return profile_along(blend_, line, step); }
  Land land_;
  Blend blend_;
};

TEST_F(ProfileOfARoof, HasItsCornersAndEvenStepsBetweenThem) {
  const Profile p = along({{0, 100}, {600, 100}, {600, 0}}, 70);
  ASSERT_EQ(p.points.size(), 1u + 9 + 2);
  EXPECT_EQ(p.length, 700);
  for (std::size_t k = 1; k < p.points.size(); ++k) {
    EXPECT_LE(p.points[k].distance - p.points[k - 1].distance, 70);
    EXPECT_NEAR(std::hypot(p.points[k].at.x - p.points[k - 1].at.x, p.points[k].at.y - p.points[k - 1].at.y),
                p.points[k].distance - p.points[k - 1].distance, 1e-9);
  }
  EXPECT_EQ(p.points[9].at.x, 600);
  EXPECT_EQ(p.points[9].at.y, 100);
  EXPECT_EQ(p.points.back().at.y, 0);
}

TEST_F(ProfileOfARoof, SumsItsClimbsAndKeepsItsBound) {
  const Profile p = along({{0, 100}, {600, 100}, {0, 100}}, 10);
  EXPECT_NEAR(p.ascent, 60, 1e-4);
  EXPECT_NEAR(p.descent, 60, 1e-4);
  EXPECT_NEAR(p.lowest, 0, 1e-4);
  EXPECT_NEAR(p.highest, 30, 1e-4);
  EXPECT_GE(p.bound_max, 0.5);
  EXPECT_LT(p.bound_max, 0.51);
  EXPECT_EQ(p.missing, 0);
  for (const ProfilePoint& q : p.points) EXPECT_NEAR(q.height, 30 - std::abs(q.at.x - 300) / 10, 1e-4);
  EXPECT_NEAR(along({{0, 100}, {600, 100}}, 400).ascent, 30, 1e-4) << "two steps of 300 m";
  EXPECT_NEAR(along({{0, 100}, {600, 100}}, 600).ascent, 0, 1e-4)
      << "negative control: steps that miss the ridge";
}

TEST_F(ProfileOfARoof, CountsTheLengthWithoutData) {
  const Profile p = along({{-100, 100}, {100, 100}}, 10);
  EXPECT_NEAR(p.missing, 100, 1e-9);
  EXPECT_TRUE(std::isnan(p.points[0].height));
  EXPECT_NEAR(p.ascent, 10, 1e-4);
  const Profile nothing = along({{-100, 0}, {-200, 0}}, 10);
  EXPECT_TRUE(std::isnan(nothing.lowest));
  EXPECT_EQ(nothing.missing, 100);
}

TEST_F(ProfileOfARoof, RefusesWhatIsNoLine) {
  EXPECT_NE(refusal_of([&] { along({{0, 0}}, 1); }), "");
  EXPECT_NE(refusal_of([&] { along({{0, 0}, {1, kHole}}, 1); }), "");
  EXPECT_NE(refusal_of([&] { along({{0, 0}, {1, 0}}, 0); }), "");
  EXPECT_NE(refusal_of([&] { along({{0, 0}, {1e9, 0}}, 1e-3); }), "");
  EXPECT_EQ(refusal_of([&] { along({{0, 0}, {0, 0}}, 1); }), "") << "a line without length is one";
}

}  // namespace
}  // namespace patchwork
