// Pictures of the terrain against the blend itself: error on the screen, cracks, the near plane, what is made
// anew.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>
#include <set>

#include "render/renderer.h"
#include "render/tile_seams.h"
#include "tests/blend/vulkan_scene.h"
#include "tests/hard_case.h"
#include "tests/render/ray_cast.h"

namespace patchwork {
namespace {

constexpr int kWidth = 256, kHeight = 144;

// Those that keep to what is asked.
constexpr std::pair<const char*, Tessellation> kWays[] = {{"hardware", Tessellation::hardware},
                                                          {"mesh", Tessellation::mesh}};

class TerrainTest : public VulkanTest {
 protected:
  static void SetUpTestSuite() { land_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static Renderer renderer(double pixel_error, std::optional<Tessellation> tessellation = {}) {
    return {test_device(),
            db(),
            {.width = kWidth,
             .height = kHeight,
             .pixel_error = pixel_error,
             .memory = std::size_t{256} << 20,
             .tessellation = tessellation}};
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

TEST_F(TerrainTest, AMeshShowsWhatHardwareShows) {
  std::mt19937_64 random(test_seed(26));
  Renderer hardware = renderer(1, Tessellation::hardware), mesh = renderer(1, Tessellation::mesh);
  std::uint64_t triangles = 0, fewer = 0;
  for (int n = 0; n < 6; ++n) {
    const Camera camera = random_camera(db(), random);
    triangles += hardware.draw(camera).triangles, fewer += mesh.draw(camera).triangles;
    const std::vector<float> a = hardware.depth(), b = mesh.depth();
    std::size_t apart = 0;
    for (std::size_t k = 0; k < a.size(); ++k) apart += std::isnan(a[k]) != std::isnan(b[k]);
    EXPECT_LE(apart, std::size_t(4 * (kWidth + kHeight))) << "outlines differ by a pixel";
  }
  EXPECT_GT(fewer, 0u);
  EXPECT_LT(fewer, triangles);
  EXPECT_TRUE(hardware.mesh().empty());
  EXPECT_EQ(mesh.tessellation(), Tessellation::mesh);
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
  const CastSurface surface = surface_of(db(), x.patches, best, 1);
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

// Of a frame's mesh: a vertex inside an edge of a triangle would tear it open.
struct Seams {
  std::size_t edges = 0, torn = 0, levels = 0;
  std::map<std::pair<std::uint32_t, int>, std::int64_t> area;  // half cells^2, twice; by draw and block
};

Seams seams_of(const std::vector<Renderer::MeshVertex>& mesh, std::span<const TileDraw> draws) {
  using Place = std::array<std::int64_t, 2>;
  const auto place = [&](std::uint32_t d, std::int64_t x, std::int64_t y) {
    return Place{draws[d].x + x * draws[d].stride, draws[d].y + y * draws[d].stride};
  };
  std::set<Place> vertices;
  std::set<std::uint32_t> strides;
  for (const auto& v : mesh) vertices.insert(place(v.draw, v.x, v.y)), strides.insert(draws[v.draw].stride);
  Seams s;
  s.levels = strides.size();
  for (std::size_t t = 0; t < mesh.size(); t += 3) {
    const Renderer::MeshVertex *a = &mesh[t], *b = a + 1, *c = a + 2;
    const int x = (a->x + b->x + c->x) / 48, y = (a->y + b->y + c->y) / 48;
    const std::int64_t twice =
        std::int64_t(b->x - a->x) * (c->y - a->y) - std::int64_t(c->x - a->x) * (b->y - a->y);
    EXPECT_GT(twice, 0);
    s.area[{a->draw, 8 * y + x}] += twice;
    for (int k = 0; k < 3; ++k) {
      const Renderer::MeshVertex &from = mesh[t + std::size_t(k)], &to = mesh[t + std::size_t((k + 1) % 3)];
      const int parts = std::gcd(to.x - from.x, to.y - from.y);
      ++s.edges;
      for (int p = 1; p < parts; ++p)
        s.torn += vertices.contains(
            place(from.draw, from.x + (to.x - from.x) / parts * p, from.y + (to.y - from.y) / parts * p));
    }
  }
  return s;
}

TEST_F(TerrainTest, AMeshCoversEachBlockOnceAndNoVertexLiesInsideAnEdge) {
  std::mt19937_64 random(test_seed(25));
  std::size_t edges = 0, torn = 0, levels = 0;
  for (const double tau : {0.5, 2.0, 8.0}) {
    Renderer r = renderer(tau, Tessellation::mesh);
    for (int n = 0; n < 8; ++n) {
      const FrameStats stats = r.draw(random_camera(db(), random));
      const auto mesh = r.mesh();
      EXPECT_LE(stats.triangles, mesh.size() / 3);
      const Seams s = seams_of(mesh, r.drawn().draws);
      for (const auto& [block, twice] : s.area) EXPECT_EQ(twice, 2 * 16 * 16);
      edges += s.edges, torn += s.torn, levels = std::max(levels, s.levels);
    }
  }
  EXPECT_GT(edges, 50000u);
  EXPECT_GT(levels, 3u);
  report_case("EdgeSplit", "edges of 24 meshes with a vertex inside", edges, double(torn), 0, "edges");
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
      }
      EXPECT_EQ(r.cache().find_violation(), "");
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

}  // namespace
}  // namespace patchwork
