// Pictures of the terrain against the blend itself: error on the screen, cracks, the near plane, what is made
// anew.
#include <gtest/gtest.h>

#include <random>

#include "render/renderer.h"
#include "tests/blend/vulkan_scene.h"
#include "tests/hard_case.h"
#include "tests/render/ray_cast.h"

namespace patchwork {
namespace {

constexpr int kWidth = 256, kHeight = 144;

class TerrainTest : public VulkanTest {
 protected:
  static void SetUpTestSuite() { land_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static Renderer renderer(double pixel_error, bool published = false) {
    return {test_device(),
            db(),
            {.width = kWidth,
             .height = kHeight,
             .pixel_error = pixel_error,
             .memory = std::size_t{256} << 20,
             .published = published}};
  }
  static std::unique_ptr<Land> land_;
};
std::unique_ptr<Land> TerrainTest::land_;

// Somewhere over the terrain, looking anywhere but up.
Camera random_camera(const Database& db, std::mt19937_64& random) {
  const Extent e = db.extent();
  std::uniform_real_distribution<double> x(e.xmin, e.xmax), y(e.ymin, e.ymax), up(5, 400), way(-1, 1),
      tilt(-1.2, 0.1);
  const Point3 eye{x(random), y(random), 400 + up(random)};
  return {eye, {eye.x + way(random), eye.y + way(random), eye.z + tilt(random)}, 60, kWidth, kHeight};
}

// Pixels of vertical distance between what was drawn and the best surface there is.
struct ScreenError {
  std::size_t pixels = 0;
  double worst = 0;
};

ScreenError screen_error(const Blend& best, const Camera& camera, const std::vector<float>& depth) {
  Points points;
  std::vector<double> z, scale;
  for (int r = 0; r < camera.height; ++r)
    for (int c = 0; c < camera.width; ++c) {
      const float d = depth[std::size_t(r * camera.width + c)];
      if (std::isnan(d)) continue;
      const glm::dvec3 p = ray(camera, c, r).at(double(d));
      points.add(p.x, p.y), z.push_back(p.z);
      // Where a metre of height here is seen, in pixels.
      const Seen low = see(camera, {p.x, p.y, p.z - 0.005}), high = see(camera, {p.x, p.y, p.z + 0.005});
      scale.push_back(std::hypot(high.x - low.x, high.y - low.y) / 0.01);
    }
  Answers answers(points.size());
  best.at_points(points.x, points.y, answers.out());
  ScreenError e;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (answers.source[k] == 0) continue;  // the outline of the data is drawn to a cell
    ++e.pixels;
    e.worst = std::max(e.worst, std::abs(z[k] - answers.height[k]) * scale[k]);
  }
  return e;
}

TEST_F(TerrainTest, TessellationError) {
  std::mt19937_64 random(test_seed(21));
  const Extraction x = extract(db(), {.error = 0});
  const Blend best(db(), x.patches, {.smoothness = 1});
  std::size_t pixels = 0;
  for (const double tau : {0.5, 1.0, 2.0, 4.0}) {
    Renderer r = renderer(tau);
    double worst = 0;
    for (int n = 0; n < 12; ++n) {
      const Camera camera = random_camera(db(), random);
      const FrameStats stats = r.draw(camera);
      EXPECT_LE(stats.pixels_reached, tau) << "all of the terrain is there";
      EXPECT_EQ(stats.tiles_wanted, 0u);
      const ScreenError e = screen_error(best, camera, r.depth());
      EXPECT_LE(e.worst, tau * 1.001 + 0.01) << "tau " << tau << " view " << n;
      worst = std::max(worst, e.worst), pixels += e.pixels;
    }
    report_case("TessellationError", "asked " + std::to_string(tau) + " px, 12 views", 12, worst,
                tau * 1.001 + 0.01, "px");
  }
  EXPECT_GT(pixels, 100000u);
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
  Renderer ours(test_device(), rough.db(), options);
  options.published = true;
  Renderer published(test_device(), rough.db(), options);
  double worst = 0, most = 0;
  for (int n = 0; n < 30; ++n) {
    Camera camera = random_camera(rough.db(), random);
    Points below;
    below.add(camera.eye.x, camera.eye.y);
    Answers ground(1);
    best.at_points(below.x, below.y, ground.out());
    if (ground.source[0] == 0) continue;
    const double lower = camera.eye.z - ground.height[0] - 20 - 4 * n;
    camera.eye.z -= lower, camera.look.z -= lower;
    published.draw(camera), ours.draw(camera);
    worst = std::max(worst, screen_error(best, camera, published.depth()).worst);
    const double guaranteed = screen_error(best, camera, ours.depth()).worst;
    EXPECT_LE(guaranteed, 2.01);
    most = std::max(most, guaranteed);
  }
  report_case("TessellationError", "asked 2 px on rough ground, low eyes", 30, most, 2.01, "px");
  report_control("TessellationError", "factors as published, the same views", 30, worst, 2.01, "px");
}

TEST_F(TerrainTest, NoBackgroundInsideTheSilhouette) {
  std::mt19937_64 random(test_seed(23));
  const Extraction x = extract(db(), {.error = 0});
  const Blend best(db(), x.patches, {.smoothness = 1});
  const CastSurface surface = surface_of(db(), x.patches, best, 1);
  constexpr int kColumns = 128, kRows = 72, kRim = 2;  // the outline of the data is drawn to a pixel
  Renderer r(test_device(), db(), {.width = kColumns, .height = kRows, .memory = std::size_t{128} << 20});
  std::size_t inside = 0, outside = 0, cracks = 0, ghosts = 0;
  for (int n = 0; n < 4; ++n) {
    Camera camera = random_camera(db(), random);
    camera.width = kColumns, camera.height = kRows;
    r.draw(camera);
    const std::vector<float> depth = r.depth();
    const std::vector<Hit> hits = cast(surface, camera);
    for (int row = kRim; row + kRim < kRows; ++row)
      for (int c = kRim; c + kRim < kColumns; ++c) {
        int covered = 0;
        for (int y = -kRim; y <= kRim; ++y)
          for (int w = -kRim; w <= kRim; ++w)
            covered += hits[std::size_t((row + y) * kColumns + c + w)].covered;
        const bool drawn = !std::isnan(depth[std::size_t(row * kColumns + c)]);
        const bool all = covered == (2 * kRim + 1) * (2 * kRim + 1), none = covered == 0;
        inside += all, outside += none;
        cracks += all && !drawn, ghosts += none && drawn;
      }
  }
  report_case("EdgeSplit", "background inside the silhouette, pixels", inside, double(cracks), 0, "pixels");
  EXPECT_EQ(ghosts, 0u);
  EXPECT_GT(inside, 4000u);
  EXPECT_GT(outside, 100u);
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
    EXPECT_TRUE(std::isfinite(stats.pixels_reached) || stats.tiles_wanted == 0);
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
  EXPECT_EQ(third.dispatches, 2u) << "a step of the camera costs factors and edges alone";
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

// Depth pictures as bits: NaN equals itself.
std::vector<std::uint32_t> bits(const std::vector<float>& v) {
  std::vector<std::uint32_t> b(v.size());
  std::memcpy(b.data(), v.data(), 4 * v.size());
  return b;
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
  const auto covered = [&] {
    std::size_t n = 0;
    for (const float d : r.depth()) n += !std::isnan(d);
    return n;
  };
  const std::size_t before = covered();
  {
    Database writer = folder_.database();
    GridFile file = surveys()[0];
    file.geotransform[0] = e.xmax + 100;
    folder_.add(writer, file, "beside");
  }
  EXPECT_TRUE(r.refresh(db));
  r.draw(camera);
  EXPECT_GT(covered(), before + 1000);
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
               {.width = kWidth, .height = kHeight, .pixel_error = tau, .memory = std::size_t{128} << 20});
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
      EXPECT_LE(error, tau * 1.001 + 0.01) << "tau " << tau << " view " << n;
      worst = std::max(worst, error / tau);
    }
    EXPECT_EQ(r.cache().find_violation(), "");
  }
  report_case("TessellationError", "views while three surveys come in", 200, worst, 1.021,
              "of the pixels asked");
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

}  // namespace
}  // namespace patchwork
