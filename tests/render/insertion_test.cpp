// Surveys that come and go while the terrain is drawn: what is made anew, and that the error is kept.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>

#include "render/tile_seams.h"
#include "tests/hard_case.h"
#include "tests/render/terrain_views.h"

namespace patchwork {
namespace {

// Depth pictures as bits: NaN equals itself.
std::vector<std::uint32_t> bits(const std::vector<float>& v) {
  std::vector<std::uint32_t> b(v.size());
  std::memcpy(b.data(), v.data(), 4 * v.size());
  return b;
}

// Pixels that show terrain.
std::size_t covered(const Renderer& r) {
  std::size_t n = 0;
  for (const float d : r.depth()) n += !std::isnan(d);
  return n;
}

class InsertionTest : public VulkanTest {
 protected:
  void SetUp() override {
    VulkanTest::SetUp();
    Database writer = folder_.database();
    folder_.add(writer, surveys()[0], "base");
  }
  Database reader() const { return Database::open(folder_.path("grids.patchwork")); }
  void insert(std::size_t k) {
    Database writer = folder_.database();
    folder_.add(writer, surveys()[k], "survey" + std::to_string(k));
  }
  void remove(std::size_t k) {
    Database writer = folder_.database();
    writer.remove("survey" + std::to_string(k));
  }
  GridFolder folder_;
};

TEST_F(InsertionTest, MakesTheTilesAnewThatItTouchesAndNoOther) {
  Database db = reader();
  const RendererOptions options{.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20};
  Renderer r(test_device(), db, options);
  const Camera camera{{800, -200, 900}, {800, 800, 300}, 60, kWidth, kHeight};
  const FrameStats first = r.draw(camera);
  EXPECT_FALSE(r.refresh(db));
  insert(2);
  EXPECT_TRUE(r.refresh(db));
  const FrameStats second = r.draw(camera);
  EXPECT_GT(second.tiles_made, 0u);
  EXPECT_LT(second.tiles_made, first.tiles_made) << "those that the survey does not touch stay";
  EXPECT_EQ(r.cache().find_violation(), "");
  // A renderer that begins here has another lattice; one that keeps it agrees with the blend.
  const Extraction x = extract(db, {.error = 0});
  const Blend best(db, x.patches, {.smoothness = 1});
  EXPECT_LE(screen_error(best, camera, r.depth()).worst, 1.01);
}

TEST_F(InsertionTest, OnceItIsTakenBackThePictureIsWhatItWasAndNoPatchIsSentAgain) {
  Database db = reader();
  Renderer r(test_device(), db, {.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20});
  const Camera camera{{800, -200, 900}, {800, 800, 300}, 60, kWidth, kHeight};
  r.draw(camera);
  const auto before = bits(r.depth());
  insert(2);
  EXPECT_TRUE(r.refresh(db));
  const FrameStats with = r.draw(camera);
  EXPECT_GT(with.patches_sent, 0u);
  EXPECT_NE(bits(r.depth()), before);
  remove(2);
  EXPECT_TRUE(r.refresh(db));
  const FrameStats without = r.draw(camera);
  EXPECT_GT(without.tiles_made, 0u);
  EXPECT_EQ(without.patches_sent, 0u) << "all that it is made from stayed on the card";
  EXPECT_EQ(bits(r.depth()), before);
}

// Where a tile held nothing, a survey may come.
TEST_F(InsertionTest, OneBesideAllDataIsSeen) {
  Database db = reader();
  Renderer r(test_device(), db, {.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20});
  const Extent e = db.extent();
  const Camera camera{{e.xmax + 200, 800, 900}, {e.xmax + 201, 800, 300}, 40, kWidth, kHeight};
  r.draw(camera);
  const std::size_t before = covered(r);
  {
    Database writer = folder_.database();
    GridFile file = surveys()[0];
    file.geotransform[0] = e.xmax + 100;
    folder_.add(writer, file, "beside");
  }
  EXPECT_TRUE(r.refresh(db));
  r.draw(camera);
  EXPECT_GT(covered(r), before + 1000);
}

// What is out of sight as it was may rise into it.
TEST_F(InsertionTest, OneThatRisesIntoSightIsSeen) {
  Database db = reader();
  const RendererOptions options{.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20};
  Renderer r(test_device(), db, options);
  const Extent e = db.extent();
  const double y = 0.5 * (e.ymin + e.ymax);
  const Camera camera{{e.xmin + 50, y, 900}, {e.xmax, y, 900}, 30, kWidth, kHeight};
  r.draw(camera);
  EXPECT_EQ(covered(r), 0u);
  {
    Database writer = folder_.database();
    GridFile file = surveys()[0];
    file.accuracy = 0.001;
    file.at = [](int, int) { return 950.0; };
    file.width = file.height = 40;
    file.geotransform[0] = 0.5 * (e.xmin + e.xmax), file.geotransform[3] = y + 20 * file.geotransform[1];
    folder_.add(writer, file, "tower");
  }
  EXPECT_TRUE(r.refresh(db));
  r.draw(camera);
  EXPECT_GT(covered(r), 1000u);
  Renderer fresh(test_device(), db, options);
  fresh.draw(camera);
  EXPECT_NEAR(double(covered(r)), double(covered(fresh)), 0.02 * double(covered(fresh)));
}

// A tile that changed is made anew in the slot that it has.
TEST_F(InsertionTest, WithAFullPoolWhatChangedIsMadeAnew) {
  for (const bool realtime : {false, true}) {
    Database db = reader();
    RendererOptions options{
        .width = kWidth, .height = kHeight, .pixel_error = 0.01, .memory = std::size_t{40} << 20};
    options.realtime = realtime;
    Renderer r(test_device(), db, options);
    const Camera camera{{800, 300, 900}, {800, 800, 300}, 60, kWidth, kHeight};
    const auto settle = [&] {
      FrameStats last = r.draw(camera);
      for (int n = 0; realtime && n < 5000 && last.tiles_wanted > 0; ++n) last = r.draw(camera);
      return last;
    };
    EXPECT_GT(settle().pixels_reached, 0.01) << "the pool is too small";
    insert(2);
    for (int n = 0; n < 5000 && !r.refresh(db); ++n) r.draw(camera);
    const FrameStats after = settle();
    EXPECT_EQ(after.tiles_wanted, 0u);
    EXPECT_EQ(after.tiles_stale, 0u);
    EXPECT_EQ(r.cache().find_violation(), "");
    remove(2);
  }
}

// Triangles that look away may show through the gaps that coarse and old tiles leave.
TEST_F(InsertionTest, WhatLooksAwayIsDrawnWhileTilesAreCoarseOrStale) {
  Database db = reader();
  RendererOptions options{
      .width = kWidth, .height = kHeight, .pixel_error = 0.5, .memory = std::size_t{128} << 20};
  options.realtime = true, options.make_ms = 1;
  Renderer r(test_device(), db, options);
  const Camera camera{{800, 300, 900}, {800, 800, 300}, 60, kWidth, kHeight};
  std::size_t coarse = 0, stale = 0;
  const auto settle = [&] {
    FrameStats last = r.draw(camera);
    for (int n = 0; n < 5000 && (last.tiles_wanted > 0 || last.tiles_stale > 0); ++n) {
      coarse += last.tiles_coarse > 0, stale += last.tiles_stale > 0;
      EXPECT_FALSE(last.front_only && last.tiles_coarse + last.tiles_stale > 0);
      last = r.draw(camera);
    }
    return last;
  };
  EXPECT_TRUE(settle().front_only);
  EXPECT_GT(coarse, 0u);
  insert(2);
  for (int n = 0; n < 5000 && !r.refresh(db); ++n) r.draw(camera);
  EXPECT_TRUE(settle().front_only);
  EXPECT_GT(stale, 0u);
}

TEST_F(InsertionTest, AskingForWhatIsNewHoldsNoWorkerUnlessThereIsSome) {
  Database db = reader();
  RendererOptions options{.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20};
  options.realtime = true, options.make_ms = 1;
  Renderer r(test_device(), db, options);
  const Camera camera{{800, -200, 900}, {800, 800, 300}, 60, kWidth, kHeight};
  FrameStats last = r.draw(camera);
  for (int n = 0; n < 5000 && last.tiles_wanted > 0; ++n) {
    EXPECT_FALSE(r.refresh(db));
    last = r.draw(camera);
    ASSERT_FALSE(last.workers_held) << "nothing is new";
  }
  EXPECT_EQ(last.tiles_wanted, 0u);
  insert(2);
  bool moved = false;
  for (int n = 0; n < 5000 && !moved; ++n) moved = r.refresh(db), last = r.draw(camera);
  EXPECT_TRUE(moved);
  EXPECT_FALSE(last.workers_held);
  EXPECT_GT(last.tiles_stale, 0u) << "old tiles are drawn until they are made anew";
  for (int n = 0; n < 5000 && last.tiles_wanted > 0; ++n) last = r.draw(camera);
  EXPECT_EQ(last.tiles_stale, 0u);
}

TEST_F(InsertionTest, OneFarAwayChangesNoPixel) {
  Database db = reader();
  Renderer r(test_device(), db, {.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20});
  const Camera camera{{200, 300, 420}, {200, 200, 380}, 30, kWidth, kHeight};  // survey 2 begins at x = 700
  r.draw(camera);
  const auto before = bits(r.depth());
  insert(2);
  EXPECT_TRUE(r.refresh(db));
  Camera step = camera;
  step.eye.x += 1;
  r.draw(step);
  r.draw(camera);
  EXPECT_EQ(bits(r.depth()), before);
}

// Two hundred views, with a survey more after each dozen: old and new tiles side by side keep to what was
// asked.
TEST_F(InsertionTest, TessellationErrorWhileSurveysComeIn) {
  for (const auto& [name, way] : kWays) {
    std::mt19937_64 random(test_seed(24));
    double worst = 0;  // in the pixels asked for
    for (const double tau : {0.5, 1.0, 2.0, 4.0}) {
      GridFolder folder;
      {
        Database writer = folder.database();
        folder.add(writer, surveys()[0], "base");
      }
      Database db = Database::open(folder.path("grids.patchwork"));
      Renderer r(test_device(), db,
                 {.width = kWidth,
                  .height = kHeight,
                  .pixel_error = tau,
                  .memory = std::size_t{128} << 20,
                  .tessellation = way});
      Extraction x = extract(db, {.error = 0});
      auto best = std::make_unique<Blend>(db, x.patches, BlendOptions{.smoothness = 1});
      for (int n = 0; n < 50; ++n) {
        if (n % 12 == 11 && n / 12 < 3) {
          Database writer = folder.database();
          folder.add(writer, surveys()[std::size_t(n / 12 + 1)], "survey" + std::to_string(n));
          best.reset();
          ASSERT_TRUE(r.refresh(db));
          x = extract(db, {.error = 0});
          best = std::make_unique<Blend>(db, x.patches, BlendOptions{.smoothness = 1});
        }
        const Camera camera = random_camera(db, random);
        const FrameStats stats = r.draw(camera);
        EXPECT_LE(stats.pixels_reached, tau);
        const double error = screen_error(*best, camera, r.depth()).worst;
        EXPECT_LE(error, tau * 1.001 + 0.01) << name << ", tau " << tau << " view " << n;
        worst = std::max(worst, error / tau);
        EXPECT_EQ(pinholes(camera, r.depth()), 0u) << name << ", tau " << tau << " view " << n;
      }
      EXPECT_EQ(r.cache().find_violation(), "");
      const Camera whole{{800, -200, 900}, {800, 800, 300}, 60, kWidth, kHeight};
      r.draw(whole);
      std::vector<float> depth = r.depth();
      const auto middle = std::size_t(kHeight / 2 * kWidth + kWidth / 2);
      ASSERT_FALSE(std::isnan(depth[middle]));
      depth[middle] = NAN;
      EXPECT_EQ(pinholes(whole, depth), 1u) << "negative control";
    }
    report_case("TessellationError", fmt::format("{}, views while three surveys come in", name), 200, worst,
                1.021, "of the pixels asked");
  }
}

TEST_F(InsertionTest, InRealTimeAFlightReachesTheSamePicture) {
  insert(1);
  Database db = reader();
  RendererOptions options{.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20};
  Renderer waits(test_device(), db, options);
  options.realtime = true, options.make_ms = 5;
  Renderer flies(test_device(), db, options);
  const Camera camera{{800, -200, 900}, {800, 800, 300}, 60, kWidth, kHeight};
  waits.draw(camera);
  const FrameStats first = flies.draw(camera);
  EXPECT_GT(first.tiles_drawn, 0u) << "something is drawn at once";
  EXPECT_GT(first.tiles_wanted, 0u);
  EXPECT_GT(first.pixels_reached, 1) << "and it says how good it is";
  FrameStats last = first;
  for (int n = 0; n < 5000 && last.tiles_wanted > 0; ++n) last = flies.draw(camera);
  EXPECT_EQ(last.tiles_wanted, 0u);
  EXPECT_LE(last.pixels_reached, 1);
  EXPECT_EQ(bits(flies.depth()), bits(waits.depth()));
}

TEST_F(InsertionTest, OnceTheLastGridIsGoneNothingIsDrawnUntilAnotherComes) {
  Database db = reader();
  RendererOptions options{.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20};
  options.effects.sun = effects::Sun{}, options.effects.shadow = effects::Shadow{};
  options.effects.sky = effects::Sky{};
  Renderer r(test_device(), db, options);
  const Camera camera{{800, -200, 900}, {800, 800, 300}, 60, kWidth, kHeight};
  r.draw(camera);
  const std::size_t before = covered(r);
  EXPECT_GT(before, 1000u);
  {
    Database writer = folder_.database();
    writer.remove("base");
  }
  EXPECT_TRUE(r.refresh(db));
  EXPECT_EQ(r.draw(camera).tiles_drawn, 0u);
  EXPECT_EQ(covered(r), 0u);
  insert(0);
  EXPECT_TRUE(r.refresh(db));
  r.draw(camera);
  EXPECT_EQ(covered(r), before);
}

// Tiles whose data go are drawn as they were until they are made anew, and then no more.
TEST_F(InsertionTest, InRealTimeOneThatGoesLeavesNoTileWithoutASlot) {
  const double beyond = reader().extent().xmax;
  {
    Database writer = folder_.database();
    GridFile file = surveys()[0];
    file.geotransform[0] = beyond + 100;
    folder_.add(writer, file, "survey9");
  }
  Database db = reader();
  RendererOptions options{.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20};
  options.realtime = true, options.make_ms = 1;
  Renderer r(test_device(), db, options);
  const Camera camera{{beyond + 900, 800, 1500}, {beyond + 901, 800, 300}, 60, kWidth, kHeight};
  FrameStats last = r.draw(camera);
  for (int n = 0; n < 5000 && last.tiles_wanted > 0; ++n) last = r.draw(camera);
  const std::size_t before = covered(r);
  EXPECT_GT(before, 1000u);
  remove(9);
  bool moved = false;
  for (int n = 0; n < 5000 && (!moved || last.tiles_wanted > 0 || last.tiles_stale > 0); ++n) {
    moved |= r.refresh(db), last = r.draw(camera);
    for (const TileDraw& d : r.drawn().draws) ASSERT_LT(d.slot, r.cache().slots());
  }
  EXPECT_TRUE(moved);
  EXPECT_LT(covered(r), before / 2);
}

// No sample of the root hits a survey.
TEST_F(InsertionTest, SurveysFarApartAreSeen) {
  const GridFolder folder;
  Database db = folder.database();
  GridFile file = surveys()[0];
  const double x = file.geotransform[0], y = file.geotransform[3];
  folder.add(db, file, "one");
  file.geotransform[0] += 9e5, file.geotransform[3] += 3e5;
  folder.add(db, file, "other");
  Renderer r(test_device(), db, {.width = kWidth, .height = kHeight, .memory = std::size_t{128} << 20});
  for (const Point at : {Point{x, y}, Point{x + 9e5, y + 3e5}}) {
    const FrameStats stats =
        r.draw({{at.x + 800, at.y - 800, 1500}, {at.x + 801, at.y - 800, 300}, 40, kWidth, kHeight});
    EXPECT_GT(covered(r), std::size_t(kWidth * kHeight) / 2);
    EXPECT_LE(stats.pixels_reached, 1);
  }
}

}  // namespace
}  // namespace patchwork
