#include "tests/render/ray_cast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "query/extract.h"
#include "tests/blend/scene.h"

namespace patchwork {
namespace {

const Camera kCamera{{0, 0, 100}, {0, 1000, -50}, 60, 48, 27};

TEST(RayCast, MeetsAPlaneWhereTheFormulaSays) {
  const auto plane = [](double x, double y) { return 0.05 * x - 0.1 * y; };
  const auto hits = cast(surface_of(plane, -1e4, 1e4, 3), kCamera, {.far = 4000});
  const glm::dvec3 up = glm::normalize(glm::dvec3(-0.05, 0.1, 1));
  int covered = 0;
  for (int row = 0; row < kCamera.height; ++row)
    for (int column = 0; column < kCamera.width; ++column) {
      const Ray r = ray(kCamera, column, row);
      const Hit& h = hits[std::size_t(row * kCamera.width + column)];
      const double t = -glm::dot(up, r.origin) / glm::dot(up, r.direction);
      ASSERT_EQ(h.covered, t > 0 && t < 4000) << column << ' ' << row << ' ' << t;
      if (!h.covered) continue;
      ++covered;
      EXPECT_NEAR(h.distance, t, 1e-8);
      EXPECT_NEAR(glm::distance(h.at, r.at(t)), 0, 1e-8);
      EXPECT_NEAR(glm::distance(h.normal, up), 0, 1e-9);
      EXPECT_FALSE(h.from_below);
    }
  EXPECT_GT(covered, 300);
  EXPECT_LT(covered, 48 * 27);
}

// A dome on a plane: rays past its silhouette go on to the plane behind.
TEST(RayCast, MeetsASphereWhereTheFormulaSays) {
  const glm::dvec3 centre(0, 500, -20);
  const double radius = 120;
  const auto dome = [&](double x, double y) {
    const double rest = radius * radius - (x - centre.x) * (x - centre.x) - (y - centre.y) * (y - centre.y);
    return std::max(rest > 0 ? centre.z + std::sqrt(rest) : -INFINITY, 0.0);
  };
  const auto hits = cast(surface_of(dome, 0, 100, 2), kCamera, {.far = 3000});
  int on_dome = 0;
  for (int row = 0; row < kCamera.height; ++row)
    for (int column = 0; column < kCamera.width; ++column) {
      const Ray r = ray(kCamera, column, row);
      const Hit& h = hits[std::size_t(row * kCamera.width + column)];
      const double b = glm::dot(r.direction, centre - r.origin);
      const double rest = b * b - glm::dot(centre - r.origin, centre - r.origin) + radius * radius;
      double t = r.direction.z < 0 ? -r.origin.z / r.direction.z : INFINITY;
      if (rest > 0 && r.at(b - std::sqrt(rest)).z > 0) t = b - std::sqrt(rest), ++on_dome;
      ASSERT_EQ(h.covered, t < 3000) << column << ' ' << row;
      if (!h.covered) continue;
      EXPECT_NEAR(h.distance, t, 1e-7);
    }
  EXPECT_GT(on_dome, 50);
}

// A wall thinner than a step, met by a ray that only grazes its crest; without a closer look it would be
// missed.
TEST(RayCast, SeesARidgeThatFallsBetweenSamples) {
  const auto ridge = [](double, double y) { return std::max(0.0, 50 - 40 * std::abs(y - 333.25)); };
  const Ray low{{0, 0, 49}, {0, 1, 0}};
  const auto hits = cast(surface_of(ridge, 0, 50, 1), std::span(&low, 1), {.far = 1000});
  ASSERT_TRUE(hits[0].covered);
  EXPECT_NEAR(hits[0].distance, 333.25 - 1 / 40.0, 1e-9);
  const Ray over{{0, 0, 50.001}, {0, 1, 0}};
  EXPECT_FALSE(cast(surface_of(ridge, 0, 51, 1), std::span(&over, 1), {.far = 1000})[0].covered);
}

TEST(RayCast, CurvatureHidesWhatLiesBelowTheHorizon) {
  // An eye 100 m above a sphere of the effect's effective radius sees the ground up to sqrt(2 R h / (1 - k)).
  const effects::Curvature earth{};
  const double reach = std::sqrt(2 * earth.radius * 100 / (1 - earth.refraction));
  const auto flat = surface_of([](double, double) { return 0.0; }, 0, 0, 20);
  const auto at_angle = [&](double below) {
    const Ray r{{0, 0, 100}, glm::normalize(glm::dvec3(0, 1, -below))};
    return cast(flat, std::span(&r, 1), {.curvature = earth, .far = 1e5})[0];
  };
  const double horizon = 2 * 100 / reach;  // slope of the tangent
  EXPECT_FALSE(at_angle(horizon * 0.999).covered);
  const Hit h = at_angle(horizon * 1.001);
  ASSERT_TRUE(h.covered);
  EXPECT_NEAR(h.distance, reach, 0.1 * reach);
  EXPECT_NEAR(h.at.z, -effects::drop(earth, h.at.y), 1e-6);
  const Ray r{{0, 0, 100}, glm::normalize(glm::dvec3(0, 1, -0.999 * horizon))};
  EXPECT_TRUE(cast(flat, std::span(&r, 1), {.far = 1e5})[0].covered) << "a flat earth has no horizon";
}

TEST(RayCast, HolesAndRimsAreNoSurface) {
  const auto plate = [](double x, double y) {
    return std::abs(x) < 50 && std::abs(y) < 50 && std::hypot(x, y) > 10 ? 0.0 : NAN;
  };
  const auto surface = surface_of(plate, 0, 0, 1);
  const auto straight_down = [&](double x) {
    const Ray r{{x, 0, 100}, {0, 0, -1}};
    return cast(surface, std::span(&r, 1), {.far = 1000})[0].covered;
  };
  EXPECT_TRUE(straight_down(49.9));
  EXPECT_FALSE(straight_down(50.1));
  EXPECT_TRUE(straight_down(10.1));
  EXPECT_FALSE(straight_down(9.9));
  const Ray up{{20, 0, -10}, {0, 0, 1}};
  EXPECT_TRUE(cast(surface, std::span(&up, 1), {.far = 1000})[0].from_below);
}

// What it says of a blend is what the blend says: the point of each hit lies on the surface, and nothing
// lies above the ray before it.
TEST(RayCast, HitsOfABlendLieOnIt) {
  const Land land(surveys());
  const Extraction x = extract(land.db(), {.error = 2});
  for (const int k : {0, 1, 2}) {
    const Blend blend(land.db(), x.patches, {.smoothness = k});
    const CastSurface surface = surface_of(land.db(), x.patches, blend);
    const Camera camera{{200, 100, 480}, {900, 900, 300}, 60, 32, 18};
    const auto hits = cast(surface, camera, {});
    int covered = 0;
    for (std::size_t n = 0; n < hits.size(); ++n) {
      if (!hits[n].covered) continue;
      ++covered;
      const Ray r = ray(camera, int(n % 32), int(n / 32));
      double z[1];
      surface.heights(std::span(&hits[n].at.x, 1), std::span(&hits[n].at.y, 1), z);
      EXPECT_NEAR(z[0], hits[n].at.z, 1e-6);
      EXPECT_NEAR(glm::distance(r.at(hits[n].distance), hits[n].at), 0, 1e-9);
      for (double part = 0.05; part < 1; part += 0.05) {
        const glm::dvec3 before = r.at(part * hits[n].distance);
        surface.heights(std::span(&before.x, 1), std::span(&before.y, 1), z);
        EXPECT_FALSE(before.z <= z[0]);
      }
    }
    EXPECT_GT(covered, 200);
  }
}

}  // namespace
}  // namespace patchwork
