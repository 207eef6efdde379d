// Pictures of the terrain against the blend itself: error on the screen, cracks, the near plane.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/hard_case.h"
#include "tests/render/terrain_views.h"

namespace patchwork {
namespace {

TEST_F(TerrainTest, TessellationError) {
  const Extraction x = extract(db(), {.error = 0});
  const Blend best(db(), x.patches, {.smoothness = 1});
  for (const auto& [name, way] : kWays) {
    std::mt19937_64 random(test_seed(21));
    std::size_t pixels = 0;
    for (const double tau : {0.5, 1.0, 2.0, 4.0}) {
      Renderer r = renderer(tau, way);
      double worst = 0;
      for (int n = 0; n < 12; ++n) {
        const Camera camera = random_camera(db(), random);
        const FrameStats stats = r.draw(camera);
        EXPECT_LE(stats.pixels_reached, tau) << "all of the terrain is there";
        EXPECT_EQ(stats.tiles_wanted, 0u);
        const ScreenError e = screen_error(best, camera, r.depth());
        EXPECT_LE(e.worst, tau * 1.001 + 0.01) << name << ", tau " << tau << " view " << n;
        worst = std::max(worst, e.worst), pixels += e.pixels;
      }
      report_case("TessellationError", fmt::format("{}, asked {} px, 12 views", name, tau), 12, worst,
                  tau * 1.001 + 0.01, "px");
    }
    EXPECT_GT(pixels, 100000u);
  }
}

// The published choices look at a block's middle, where the nearest point is nearer.
TEST_F(TerrainTest, TessellationAsPublishedExceedsWhatWasAsked) {
  std::mt19937_64 random(test_seed(22));
  // Ground that is rough from sample to sample.
  GridFile file{.width = 150, .height = 150, .geotransform = {0, 12, 0, 1800, 0, -12}, .accuracy = 0.01};
  file.at = [](int i, int j) {
    return 300 + 20 * std::sin(i / 9.0) * std::cos(j / 7.0) + 4 * std::sin(12.9898 * i * i + 78.233 * j);
  };
  const Land rough({file});
  const Extraction x = extract(rough.db(), {.error = 0});
  const Blend best(rough.db(), x.patches, {.smoothness = 1});
  RendererOptions options{
      .width = kWidth, .height = kHeight, .pixel_error = 2, .memory = std::size_t{256} << 20};
  const auto with = [&](Tessellation way) {
    options.tessellation = way;
    return Renderer(test_device(), rough.db(), options);
  };
  Renderer hardware = with(Tessellation::hardware), mesh = with(Tessellation::mesh),
           published = with(Tessellation::published);
  double worst = 0, most[2] = {0, 0};
  for (int n = 0; n < 30; ++n) {
    Camera camera = random_camera(rough.db(), random);
    Points below;
    below.add(camera.eye.x, camera.eye.y);
    Answers ground(1);
    best.at_points(below.x, below.y, ground.out());
    if (ground.source[0] == 0) continue;
    const double lower = camera.eye.z - ground.height[0] - 20 - 4 * n;
    camera.eye.z -= lower, camera.look.z -= lower;
    published.draw(camera);
    worst = std::max(worst, screen_error(best, camera, published.depth()).worst);
    for (const int k : {0, 1}) {
      Renderer& ours = k ? mesh : hardware;
      ours.draw(camera);
      const double guaranteed = screen_error(best, camera, ours.depth()).worst;
      EXPECT_LE(guaranteed, 2.01) << kWays[k].first;
      most[k] = std::max(most[k], guaranteed);
    }
  }
  for (const int k : {0, 1})
    report_case("TessellationError", fmt::format("{}, asked 2 px on rough ground, low eyes", kWays[k].first),
                30, most[k], 2.01, "px");
  report_control("TessellationError", "factors as published, the same views", 30, worst, 2.01, "px");
}

TEST_F(TerrainTest, NoBackgroundInsideTheSilhouette) {
  const Extraction x = extract(db(), {.error = 0});
  const Blend best(db(), x.patches, {.smoothness = 1});
  const CastSurface surface = surface_of(db(), x.patches, best);
  constexpr int kColumns = 128, kRows = 72, kRim = 2;  // the outline of the data is drawn to a pixel
  std::mt19937_64 random(test_seed(23));
  std::vector<Camera> cameras;
  std::vector<std::vector<Hit>> hits;
  for (int n = 0; n < 4; ++n) {
    cameras.push_back(random_camera(db(), random));
    cameras.back().width = kColumns, cameras.back().height = kRows;
    hits.push_back(cast(surface, cameras.back()));
  }
  for (const auto& [name, way] : kWays) {
    Renderer r(test_device(), db(),
               {.width = kColumns, .height = kRows, .memory = std::size_t{128} << 20, .tessellation = way});
    std::size_t inside = 0, outside = 0, cracks = 0, ghosts = 0;
    for (std::size_t n = 0; n < cameras.size(); ++n) {
      r.draw(cameras[n]);
      const std::vector<float> depth = r.depth();
      for (int row = kRim; row + kRim < kRows; ++row)
        for (int c = kRim; c + kRim < kColumns; ++c) {
          int covered = 0;
          for (int y = -kRim; y <= kRim; ++y)
            for (int w = -kRim; w <= kRim; ++w)
              covered += hits[n][std::size_t((row + y) * kColumns + c + w)].covered;
          const bool drawn = !std::isnan(depth[std::size_t(row * kColumns + c)]);
          const bool all = covered == (2 * kRim + 1) * (2 * kRim + 1), none = covered == 0;
          inside += all, outside += none;
          cracks += all && !drawn, ghosts += none && drawn;
        }
    }
    report_case("EdgeSplit", fmt::format("{}, background inside the silhouette, pixels", name), inside,
                double(cracks), 0, "pixels");
    EXPECT_EQ(ghosts, 0u);
    EXPECT_GT(inside, 4000u);
    EXPECT_GT(outside, 100u);
  }
}

// Over ground without gaps what looks away is hidden by what looks towards the eye, and left out. A hole out
// of sight forbids that, and nothing else: both draw the same.
TEST_F(TerrainTest, WhatLooksAwayIsLeftOutOnlyWhereItIsHidden) {
  const auto ground = [](bool whole, double east) {
    GridFile file{.width = 150, .height = 150, .geotransform = {east, 12, 0, 1800, 0, -12}, .accuracy = 0.01};
    file.at = [=](int i, int j) {
      if (!whole && i > 146 && j > 146) return double(NAN);
      return 300 + 40 * std::sin(i / 9.0) * std::cos(j / 7.0) + 2 * std::sin(12.9898 * i * i + 78.233 * j);
    };
    return file;
  };
  const Land whole({ground(true, 0)}), holed({ground(false, 0)});
  const Land beside({ground(true, 0), ground(true, 900)});  // one reaches beyond the other
  RendererOptions options{
      .width = kWidth, .height = kHeight, .pixel_error = 1, .memory = std::size_t{128} << 20};
  std::mt19937_64 random(test_seed(26));
  for (const auto& [name, way] : kWays) {
    options.tessellation = way;
    Renderer front(test_device(), whole.db(), options), all(test_device(), holed.db(), options),
        two(test_device(), beside.db(), options);
    std::size_t pixels = 0;
    for (int n = 0; n < 20; ++n) {
      std::uniform_real_distribution<double> at(100, 1200), up(360, 420), to(100, 1200);
      const Camera camera{{at(random), at(random), up(random)}, {to(random), 1700, 250}, 60, kWidth, kHeight};
      ASSERT_TRUE(front.draw(camera).front_only);
      ASSERT_FALSE(all.draw(camera).front_only) << "it has a hole";
      ASSERT_FALSE(two.draw(camera).front_only) << "its outline is not convex";
      const std::vector<float> ours = front.depth(), theirs = all.depth();
      std::size_t differ = 0;
      for (std::size_t k = 0; k < ours.size(); ++k) {
        ASSERT_EQ(std::isnan(ours[k]), std::isnan(theirs[k])) << name << " view " << n;
        differ += !std::isnan(ours[k]) && ours[k] != theirs[k];
      }
      for (const float d : ours) pixels += !std::isnan(d);
      EXPECT_LE(differ, 3u) << name << " view " << n
                            << ": a crest may hit a pixel's centre with its far side alone";
    }
    EXPECT_GT(pixels, 100000u);
    // From beside, and from below the summits, one may see what looks away.
    EXPECT_FALSE(front.draw({{-500, 900, 500}, {900, 900, 300}, 60, kWidth, kHeight}).front_only);
    EXPECT_FALSE(front.draw({{900, 900, 200}, {1200, 900, 300}, 60, kWidth, kHeight}).front_only);
    RendererOptions near = options;
    near.far = 5000;
    EXPECT_FALSE(Renderer(test_device(), whole.db(), near)
                     .draw({{900, 900, 500}, {900, 1700, 250}, 60, kWidth, kHeight})
                     .front_only)
        << "tiles that hide may be left out";
    EXPECT_TRUE(front.draw({{900, 900, 500}, {900, 1700, 250}, 60, kWidth, kHeight}).front_only);
    front.draw({{900, 900, 200}, {1200, 900, 300}, 60, kWidth, kHeight});
    std::size_t below = 0;
    for (const float d : front.depth()) below += !std::isnan(d);
    EXPECT_GT(below, 1000u) << "an eye under the ground sees it from below";
  }
}

// Where the pool is too small for what is asked, the tiles that matter most get it: asking for more makes
// nothing worse.
TEST_F(TerrainTest, AskingForMoreThanThePoolHoldsReachesNoLess) {
  const Camera camera{{300, 200, 700}, {900, 900, 300}, 60, kWidth, kHeight};
  std::vector<double> reached;
  for (const double asked : {4.0, 2.0, 1.0, 0.5, 0.25, 0.1}) {
    Renderer r(test_device(), db(),
               {.width = kWidth, .height = kHeight, .pixel_error = asked, .memory = std::size_t{40} << 20});
    const FrameStats s = r.draw(camera);
    std::printf("asked %g, reached %g: %zu tiles of %u\n", asked, s.pixels_reached, s.tiles_drawn,
                r.cache().slots());
    reached.push_back(s.pixels_reached);
    const std::size_t made = s.tiles_made;
    EXPECT_EQ(r.draw(camera).tiles_made, 0u) << "asked " << asked << ", made " << made;
  }
  EXPECT_EQ(reached.front(), 4);
  EXPECT_GT(reached.back(), 0.1) << "the pool is too small for that";
  for (std::size_t k = 1; k < reached.size(); ++k) EXPECT_LE(reached[k], reached[k - 1]);
}

// Whatever it drew before, and whether it waits or not.
TEST_F(TerrainTest, AFullPoolGoesToWhatMattersNow) {
  RendererOptions options{
      .width = kWidth, .height = kHeight, .pixel_error = 0.1, .memory = std::size_t{40} << 20};
  const Camera before{{300, 200, 700}, {900, 900, 300}, 60, kWidth, kHeight};
  const Camera after{{500, 450, 600}, {1000, 1200, 300}, 60, kWidth, kHeight};
  const auto sorted = [](std::vector<TileKey> tiles) {
    std::sort(tiles.begin(), tiles.end());
    return tiles;
  };
  for (const TilePolicy policy : {TilePolicy::first, TilePolicy::lru, TilePolicy::lru_error}) {
    options.policy = policy;
    Renderer fresh(test_device(), db(), options), moved(test_device(), db(), options);
    const FrameStats at_once = fresh.draw(after);
    EXPECT_GT(at_once.pixels_reached, 0.1) << "the pool is too small";
    moved.draw(before);
    const FrameStats later = moved.draw(after);
    EXPECT_GT(later.tiles_made, 0u);
    EXPECT_EQ(later.pixels_reached, at_once.pixels_reached);
    EXPECT_EQ(sorted(moved.tiles()), sorted(fresh.tiles()));
    RendererOptions live = options;
    live.realtime = true, live.make_ms = 1;
    Renderer flies(test_device(), db(), live);
    FrameStats s;
    for (const Camera& camera : {before, after})
      for (int n = 0; n < 5000; ++n)
        if (s = flies.draw(camera); s.tiles_wanted == 0) break;
    EXPECT_EQ(s.tiles_wanted, 0u);
    EXPECT_EQ(sorted(flies.tiles()), sorted(fresh.tiles()));
  }
}

// An eye inside the boxes of tiles, a hand above the ground, looking down, and looking away from everything.
TEST_F(TerrainTest, NearPlane) {
  Renderer r = renderer(1);
  const Extraction x = extract(db(), {.error = 0});
  const Blend best(db(), x.patches, {.smoothness = 1});
  Points eye;
  eye.add(900, 800);
  Answers ground(1);
  best.at_points(eye.x, eye.y, ground.out());
  const double z = ground.height[0];
  for (const Point3 look : {Point3{900, 800, z - 100}, Point3{901, 800, z + 0.3}, Point3{900, 801, z - 2}}) {
    const Camera camera{{900, 800, z + 0.5}, look, 60, kWidth, kHeight};
    const FrameStats stats = r.draw(camera);
    EXPECT_LE(stats.pixels_reached, 1);
    EXPECT_EQ(stats.tiles_wanted, 0u);
    std::size_t seen = 0;
    for (const float d : r.depth())
      if (!std::isnan(d)) {
        ++seen;
        EXPECT_GT(d, 0);
      }
    EXPECT_GT(seen, std::size_t(kWidth * kHeight / 4));
    EXPECT_LE(screen_error(best, camera, r.depth()).worst, 1.01);
  }
  report_law("NearPlane", "an eye half a metre above the ground among the tiles", 3);
  // An edge that passes half a metre below an eye which looks along it, from 50 m ahead to 50 m behind.
  const auto divided_by_w = [](double ahead) { return -0.5 / ahead; };
  const double ends = std::abs(divided_by_w(50) - divided_by_w(-50));
  const double in_front = std::abs(divided_by_w(50) - divided_by_w(0.1));
  report_control("NearPlane", "what is seen of an edge past the eye, its ends divided by w", 1,
                 in_front / ends, 1, "of its length by its ends");
  const FrameStats nothing = r.draw({{900, 800, z + 50}, {900, 800, z + 100}, 60, kWidth, kHeight});
  EXPECT_EQ(nothing.triangles, 0u);
  for (const float d : r.depth()) EXPECT_TRUE(std::isnan(d));
}

TEST_F(TerrainTest, WithNothingChangedNothingIsSentOrDispatched) {
  Renderer r = renderer(1);
  const Camera camera{{300, 300, 500}, {900, 900, 300}, 60, kWidth, kHeight};
  const FrameStats first = r.draw(camera), second = r.draw(camera);
  EXPECT_GT(first.tiles_made, 0u);
  EXPECT_GT(first.dispatches, 2u);
  EXPECT_EQ(second.tiles_made, 0u);
  EXPECT_EQ(second.dispatches, 0u);
  EXPECT_EQ(second.draws, 0u);
  EXPECT_EQ(second.bytes_up, 0u);
  Camera moved = camera;
  moved.eye.x += 1;
  const FrameStats third = r.draw(moved);
  EXPECT_EQ(third.dispatches, r.tessellation() == Tessellation::mesh ? 3u : 2u)
      << "a step of the camera costs how blocks are divided alone";
  EXPECT_EQ(third.tiles_made, 0u);
}

// The same land from a distance, surveyed more and more finely: the picture needs no more triangles.
TEST_F(TerrainTest, AWholeMapCostsNoMoreWithSixteenTimesTheData) {
  std::vector<double> triangles;
  for (const int samples : {81, 161, 321}) {
    const double step = 1600.0 / (samples - 1);
    const Land land(
        {survey({.width = samples, .height = samples, .geotransform = {0, step, 0, 1600, 0, -step}}, 0)});
    Renderer r(test_device(), land.db(),
               {.width = kWidth, .height = kHeight, .pixel_error = 2, .memory = std::size_t{128} << 20});
    const FrameStats s = r.draw(overview(land.db().extent(), 200, 400, 45, kWidth, kHeight));
    EXPECT_LE(s.pixels_reached, 2);
    triangles.push_back(double(s.triangles));
  }
  std::printf("triangles: %g %g %g\n", triangles[0], triangles[1], triangles[2]);
  EXPECT_LE(triangles[2], 1.5 * triangles[0]);
  EXPECT_GT(triangles[2], 0.5 * triangles[0]);
}

}  // namespace
}  // namespace patchwork
