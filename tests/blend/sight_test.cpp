// GrazingRays (hard cases): lines of sight against dense marching along them, and against closed forms.
#include "blend/sight.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

constexpr Air kFlat{.curved = false};

// Walls one sample wide, steps of 40 m from one sample to the next, and holes, over the hills.
GridFile walls() {
  GridFile file{.width = 120, .height = 100, .geotransform = rotated(600, 700, 11, 3, 3), .accuracy = 0.1};
  file = of_terrain(file, hills);
  file.at = [exact = file.at](int i, int j) {
    if (i % 37 > 30 && j % 29 > 24) return kHole;
    const double wall = (i * 7 + j * 3) % 41 == 0 ? 12 : 0, step = (i / 17 + j / 13) % 2 ? 40 : 0;
    return exact(i, j) + wall + step;
  };
  return file;
}

// PATCHWORK_TRIALS=1000000 takes as many rays as the design asks for.
std::size_t trials() { return std::size_t(test_trials(4000)); }

class GrazingRays : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::vector<GridFile> grids = surveys();
    grids.push_back(walls());
    land_ = std::make_unique<Land>(grids);
  }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static std::unique_ptr<Land> land_;
};
std::unique_ptr<Land> GrazingRays::land_;

double height_at(const Blend& surface, Point p) {
  double h = NAN;
  surface.at_points(std::span(&p.x, 1), std::span(&p.y, 1),
                    {.height = std::span(&h, 1), .bound = {}, .source = {}, .patch = {}});
  return std::isnan(h) ? 300 : h;
}

// Rays that a search by steps, or by lines of cells alone, would get wrong.
class Rays {
 public:
  Rays(const Database& db, const Blend& surface, std::uint64_t seed)
      : db_(db), surface_(surface), random_(seed) {}

  SightRay next() {
    switch (std::uniform_int_distribution<int>(0, 3)(random_)) {
      case 0:
        return anywhere();
      case 1:
        return grazing();
      case 2:
        return along_the_lattice();
      default:
        return through_corners();
    }
  }

 private:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  Point place() {
    const Extent e = db_.extent();
    return {uniform(e.xmin, e.xmax), uniform(e.ymin, e.ymax)};
  }
  SightRay over(Point a, Point b, double above_a, double above_b) const {
    return {{a.x, a.y, height_at(surface_, a) + above_a}, {b.x, b.y, height_at(surface_, b) + above_b}};
  }

  SightRay anywhere() {
    const Point a = place();
    const double length = uniform(5, 400), angle = uniform(0, 2 * M_PI);
    return over(a, {a.x + length * std::cos(angle), a.y + length * std::sin(angle)}, uniform(-2, 30),
                uniform(-2, 30));
  }
  // Tangent to the surface within a hundredth of a degree, some millimetres off.
  SightRay grazing() {
    const Point q = place();
    const double angle = uniform(0, 2 * M_PI), half = uniform(2, 150);
    const double cx = std::cos(angle), cy = std::sin(angle);
    const double h = height_at(surface_, q);
    const double slope = (height_at(surface_, {q.x + 0.01 * cx, q.y + 0.01 * cy}) - h) / 0.01 +
                         std::tan(uniform(-0.01, 0.01) * M_PI / 180);
    const double off = uniform(-0.05, 0.05);
    return {{q.x - half * cx, q.y - half * cy, h + off - half * slope},
            {q.x + half * cx, q.y + half * cy, h + off + half * slope}};
  }
  const Grid& any_grid() {
    return db_.grids()[std::uniform_int_distribution<std::size_t>(0, db_.grids().size() - 1)(random_)];
  }
  Point vertex(const Grid& g) {
    const GridShape& s = g.info.shape;
    const int step = uniform(0, 1) < 0.3 ? kKernelCells : 1;  // rims of patches too
    const auto pick = [&](int n) {
      return double(std::uniform_int_distribution<int>(0, n - 1)(random_) / step * step);
    };
    return {pick(s.width()), pick(s.height())};
  }
  SightRay along_the_lattice() {
    const Grid& g = any_grid();
    const Point v = vertex(g);
    const double n = std::round(uniform(2, 50)), off = uniform(-1, 1);
    const bool along_i = uniform(0, 1) < 0.5;
    return over(g.info.frame.to_domain(v.x, v.y),
                g.info.frame.to_domain(v.x + (along_i ? n : 0), v.y + (along_i ? 0 : n)), off, off);
  }
  SightRay through_corners() {
    const Grid& g = any_grid();
    const Point v = vertex(g);
    const double n = std::round(uniform(1, 40)), slope = uniform(0, 1) < 0.5 ? 1 : -0.5;
    return over(g.info.frame.to_domain(v.x, v.y), g.info.frame.to_domain(v.x + n, v.y + slope * n),
                uniform(-0.1, 3), uniform(-0.1, 3));
  }

  const Database& db_;
  const Blend& surface_;
  std::mt19937_64 random_;
};

// A ray, and the surface above it at even steps.
struct March {
  static constexpr double kStep = 0.2;  // metres
  std::vector<double> x, y, above, bound;
  double ground;

  March(const Blend& surface, const SightRay& r, const Air& air) {
    const double dx = r.to.x - r.from.x, dy = r.to.y - r.from.y;
    ground = std::hypot(dx, dy);
    const auto n = std::size_t(std::max(2.0, std::ceil(ground / kStep) + 1));
    for (std::size_t k = 0; k < n; ++k) {
      const double t = double(k) / double(n - 1);
      x.push_back(r.from.x + t * dx), y.push_back(r.from.y + t * dy);
    }
    above.resize(n), bound.resize(n);
    surface.at_points(x, y, {.height = above, .bound = bound, .source = {}, .patch = {}});
    for (std::size_t k = 0; k < n; ++k) {
      const double t = double(k) / double(n - 1);
      above[k] -= r.from.z + t * (r.to.z - r.from.z) - t * (1 - t) * drop(ground, air);
    }
  }
  double distance(std::size_t k) const { return ground * double(k) / double(x.size() - 1); }
  double most(std::size_t every = 1) const {
    double m = -INFINITY;
    for (std::size_t k = 0; k < above.size(); k += every)
      if (above[k] > m) m = above[k];
    return m;
  }
  double first_above(double least) const {
    for (std::size_t k = 0; k < above.size(); ++k)
      if (above[k] > least) return distance(k);
    return INFINITY;
  }
};

// False position without a guard: how many evaluations it takes to bring a bracket below a millimetre.
std::uint32_t naive_steps(const Blend& surface, const SightRay& r, const March& m, std::uint32_t most) {
  std::size_t k = 0;
  while (k < m.above.size() && !(m.above[k] > 0)) ++k;
  if (k == 0 || k == m.above.size() || std::isnan(m.above[k - 1])) return 0;
  double a = m.distance(k - 1) / m.ground, b = m.distance(k) / m.ground, fa = m.above[k - 1], fb = m.above[k];
  std::uint32_t steps = 0;
  while ((b - a) * m.ground > 1e-3 && steps < most) {
    const double t = a - fa * (b - a) / (fb - fa);
    const double f =
        height_at(surface, {r.from.x + t * (r.to.x - r.from.x), r.from.y + t * (r.to.y - r.from.y)}) -
        (r.from.z + t * (r.to.z - r.from.z));
    f > 0 ? (b = t, fb = f) : (a = t, fa = f);
    ++steps;
  }
  return steps;
}

TEST_F(GrazingRays, MissNothingThatDenseMarchingSees) {
  std::size_t blocked = 0, open = 0, missed_by_steps = 0, searched = 0, unguarded = 0, unguarded_beyond = 0;
  std::size_t undecided = 0;
  double worst = 0;
  const std::uint64_t seed = test_seed(11);
  std::vector<BlendOptions> blends = all_blends();
  const std::size_t each = std::max<std::size_t>(1, trials() / (2 * blends.size()));
  for (const double error : {0.0, 4.0})
    for (const BlendOptions& options : blends) {
      const Extraction x = extract(db(), {.error = error});
      const SightLines lines(db(), x.patches, options);
      Rays rays(db(), lines.surface(), seed + std::uint64_t(error) + std::uint64_t(options.smoothness));
      for (std::size_t done = 0; done < each; done += 1024) {
        std::vector<SightRay> some;
        for (std::size_t k = done; k < std::min(each, done + 1024); ++k) some.push_back(rays.next());
        const Air air{.curved = (done / 1024 + std::size_t(options.smoothness)) % 2 == 0,
                      .refraction = 0.13,
                      .radius = 5e4};
        const std::vector<Sight> found = lines.find(some, air);
        for (std::size_t k = 0; k < some.size(); ++k) {
          const March m(lines.surface(), some[k], air);
          const Sight& s = found[k];
          const std::string which =
              name_of(options) + " error " + std::to_string(error) + " ray " + std::to_string(done + k);
          const double most = m.most();
          worst = std::max(worst, most + s.clearance);
          ASSERT_LE(most, -s.clearance + SightLines::kClearance) << which;
          ASSERT_EQ(s.blocked, s.clearance < -1e-6) << which;
          double may = -INFINITY, must = -INFINITY;
          for (std::size_t p = 0; p < m.above.size(); ++p)
            if (!std::isnan(m.above[p]))
              may = std::max(may, m.above[p] + m.bound[p]), must = std::max(must, m.above[p] - m.bound[p]);
          ASSERT_FALSE(s.verdict == Verdict::visible && may > SightLines::kClearance) << which << ": " << may;
          ASSERT_FALSE(s.verdict != Verdict::hidden && must > SightLines::kClearance)
              << which << ": " << must;
          undecided += s.verdict == Verdict::undecided;
          missed_by_steps += s.blocked && m.most(15) <= 0;
          (s.blocked ? blocked : open) += 1;
          if (!s.blocked) continue;
          ASSERT_LE(s.hit_distance, m.first_above(SightLines::kClearance) + 1e-3) << which;
          const double n = std::max<double>(1, s.bracket);
          ASSERT_LE(s.searched, 2 * std::log2(n) + 3) << which;
          searched += s.searched > 0;
          if (k % 8 != 0 || air.curved) continue;
          const std::uint32_t steps = naive_steps(lines.surface(), some[k], m, 60);
          unguarded += steps > 0, unguarded_beyond += steps > 2 * std::log2(March::kStep / 1e-3) + 3;
        }
      }
    }
  report_case("GrazingRays", "dense marching sees more of a ray blocked, at most", blocked + open,
              std::max(worst, 0.0), SightLines::kClearance, "m");
  report_law("GrazingRays", "verdicts hold by the bounds at every step of a dense march", blocked + open);
  EXPECT_GT(std::min(blocked, open), trials() / 10);
  EXPECT_GT(searched, trials() / 20);
  EXPECT_GT(undecided, trials() / 50);
  std::printf("unguarded interpolation exceeds the cap for %zu of %zu\n", unguarded_beyond, unguarded);
  EXPECT_GT(unguarded_beyond, 0u) << "negative control: a search without a guard";
  EXPECT_GT(missed_by_steps, 0u) << "negative control: steps of 3 m miss ridges";
}

struct Told {
  double height = NAN, bound = NAN;
};
Told told_at(const Blend& surface, double x, double y) {
  Told t;
  surface.at_points(
      std::span(&x, 1), std::span(&y, 1),
      {.height = std::span(&t.height, 1), .bound = std::span(&t.bound, 1), .source = {}, .patch = {}});
  return t;
}

// The other side of the march: what is reported is there. A clearance that is too small, a hit where nothing
// is or a verdict without a witness would all pass it.
TEST_F(GrazingRays, ReportNothingThatIsNotThere) {
  const std::uint64_t seed = test_seed(12);
  std::size_t tries = 0, hits = 0, hidden = 0, visible = 0, undecided = 0, shallow = 0;
  for (const double error : {0.0, 4.0})
    for (const BlendOptions& options : all_blends()) {
      const Extraction x = extract(db(), {.error = error});
      const SightLines lines(db(), x.patches, options);
      double least = INFINITY, largest = 0;  // of the bounds that there can be
      for (const PatchId id : x.patches) {
        const double e = db().patch(id).error[std::size_t(options.smoothness)];
        least = std::min(least, e), largest = std::max(largest, e + db().grid(id.grid()).info.rim_error);
      }
      Rays rays(db(), lines.surface(), seed + std::uint64_t(error));
      std::vector<SightRay> some;
      for (int k = 0; k < 50; ++k) some.push_back(rays.next());
      const Air air{.curved = options.smoothness == 1, .refraction = 0.13, .radius = 5e4};
      const std::vector<Sight> found = lines.find(some, air);
      for (std::size_t k = 0; k < some.size(); ++k) {
        const Sight& s = found[k];
        const SightRay& r = some[k];
        const double dx = r.to.x - r.from.x, dy = r.to.y - r.from.y, ground = std::hypot(dx, dy);
        const auto z_at = [&](double t) {
          return r.from.z + t * (r.to.z - r.from.z) - t * (1 - t) * drop(ground, air);
        };
        SCOPED_TRACE(name_of(options) + " error " + std::to_string(error) + " ray " + std::to_string(k));
        ++tries;
        hidden += s.verdict == Verdict::hidden, visible += s.verdict == Verdict::visible;
        undecided += s.verdict == Verdict::undecided;
        if (std::isfinite(s.clearance)) {
          const Told there = told_at(lines.surface(), s.nearest.x, s.nearest.y);
          EXPECT_NEAR(there.height, s.nearest.z, 1e-6);
          EXPECT_NEAR(there.bound, s.nearest_bound, 1e-9);
          EXPECT_NEAR(z_at(s.nearest_distance / ground) - s.nearest.z, s.clearance, 1e-6);
          if (s.verdict == Verdict::visible) {
            EXPECT_LE(s.nearest_bound - s.clearance, 1e-6);
          } else {
            EXPECT_LT(s.clearance, largest) << "no bound reaches the ray";
          }
          if (s.verdict != Verdict::hidden) {
            EXPECT_LE(-s.clearance - s.nearest_bound, 1e-6);
          }
        } else {
          EXPECT_EQ(s.verdict, Verdict::visible);
        }
        if (s.verdict == Verdict::hidden) {
          EXPECT_TRUE(s.blocked);
          EXPECT_GT(-s.clearance, least - 1e-9) << "no bound is small enough to be sure";
        }
        if (!s.blocked) continue;
        ++hits, shallow += -s.clearance <= least;
        EXPECT_NE(s.verdict, Verdict::visible);
        const Told at = told_at(lines.surface(), s.hit.x, s.hit.y);
        EXPECT_GE(at.height, s.hit.z);
        EXPECT_EQ(at.bound, s.hit_bound);
        EXPECT_NEAR(z_at(s.hit_distance / ground), s.hit.z, 1e-6);
        const double before = s.hit_distance - 1.5e-3;
        if (before <= 0) continue;
        const double t = before / ground;
        const Told earlier = told_at(lines.surface(), r.from.x + t * dx, r.from.y + t * dy);
        EXPECT_FALSE(earlier.height - z_at(t) > SightLines::kClearance)
            << "it rises before " << s.hit_distance;
      }
    }
  EXPECT_GT(hits, 50u);
  EXPECT_GT(std::min({hidden, visible, undecided}), 0u);
  EXPECT_GT(shallow, 0u) << "negative control: to take every blocked ray for hidden would be seen";
  report_law("GrazingRays", "what is reported is there: clearances, hits, verdicts, every blend", tries);
}

// A pit far below a ray, surveyed finely, in a plain of large cells: the plain is not one parabola across it.
TEST(GrazingRaysOverAPit, AreHiddenByThePlainBeforeIt) {
  const Land land(
      {of_terrain({.width = 65, .height = 65, .geotransform = {-45, 90, 0, 5805, 0, -90}, .accuracy = 1},
                  [](double x, double) { return 0.1 * x; }),
       of_terrain({.width = 300, .height = 300, .geotransform = {1899, 2, 0, 3201, 0, -2}, .accuracy = 0.1},
                  [](double, double) { return -40.0; })});
  const SightLines lines(land.db(), extract(land.db(), {.error = 0}).patches, {});
  const SightRay ray{{1810, 2900, 182.7}, {2300, 2900, 207.2}};
  const Sight s = lines.find({&ray, 1}, kFlat)[0];
  EXPECT_TRUE(s.blocked);
  EXPECT_EQ(s.verdict, Verdict::hidden);
  EXPECT_NEAR(s.hit_distance, 34, 0.1) << "where the plain rises above the ray";
  EXPECT_LT(s.clearance, -2);
}

// Depths: the raw samples' scale is negative, so the least of them is the highest place.
TEST(GrazingRaysOverDepths, AreHiddenByARidge) {
  GridFolder folder;
  Database db = folder.database();
  const std::string file =
      folder.write({.width = 61,
                    .height = 40,
                    .geotransform = {0, 10, 0, 400, 0, -10},
                    .at = [](int i, int) { return i == 30            ? 20.0
                                                  : i < 10 || i > 50 ? 100.0
                                                                     : 150.0; }},
                   "depths");
  {
    const GDALDatasetUniquePtr raw(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    ASSERT_TRUE(raw && raw->GetRasterBand(1)->SetScale(-1) == CE_None);
  }
  db.import(RasterSource::open(file, {.accuracy = 0.1}, ""), {.name = "depths"});
  for (const int k : {0, 1, 2}) {
    const SightLines lines(db, extract(db, {.error = 0}).patches, {.smoothness = k});
    const SightRay ray{{55, 200, -98}, {555, 200, -98}};
    EXPECT_TRUE(lines.find({&ray, 1}, kFlat)[0].blocked) << "k = " << k;
    const SightRay above{{55, 200, 20}, {555, 200, 20}};
    EXPECT_FALSE(lines.find({&above, 1}, kFlat)[0].blocked) << "k = " << k;
  }
}

// A level plain of 50 m, 30 km wide.
class LevelPlain : public ::testing::Test {
 protected:
  LevelPlain()
      : land_({{.width = 301,
                .height = 9,
                .geotransform = {-5000, 100, 0, 400, 0, -100},
                .accuracy = 0.5,
                .at = [](int, int) { return 50.0; }}}),
        lines_(land_.db(), extract(land_.db(), {.error = 0}).patches, {}) {}
  Sight look(const SightRay& r, const Air& air) const { return lines_.find({&r, 1}, air)[0]; }
  Land land_;
  SightLines lines_;
};

TEST_F(LevelPlain, DropsAwayFromALevelLineOfSightAsTheClosedFormSays) {
  const double radius = 6'371'000;
  for (const double refraction : {0.0, 0.13}) {
    const Air air{.refraction = refraction};
    const double closed = 1e8 * (1 - refraction) / (2 * radius);
    EXPECT_NEAR(closed, refraction == 0 ? 7.85 : 6.83, 0.005);
    // Level at its end, 10 km away, the ray is there `closed` lower against the plain than at its beginning.
    const SightRay ray{{0, 0, 50 + 10}, {20'000, 0, 50 + 10}};
    const Sight s = look(ray, air);
    EXPECT_FALSE(s.blocked);
    EXPECT_NEAR(s.clearance, 10 - closed, 1e-3) << "refraction " << refraction;
    EXPECT_NEAR(s.nearest_distance, 10'000, 30) << "refraction " << refraction;
    const SightRay level = directed_ray({0, 0, 60}, 90, 0, 10'000, air);
    EXPECT_NEAR(level.to.x, 10'000, 1e-9);
    EXPECT_NEAR(level.to.z - 60, closed, 1e-3);
  }
  EXPECT_NEAR(look({{0, 0, 60}, {20'000, 0, 60}}, kFlat).clearance, 10, 1e-9)
      << "negative control: no earth curve";
}

TEST_F(LevelPlain, HidesWhatIsBeyondTheHorizon) {
  const Air air{};
  // An eye h above the ground sees the horizon at sqrt(2 R h / (1 - k)).
  const double h = 10, horizon = std::sqrt(2 * air.radius * h / (1 - air.refraction));
  ASSERT_LT(horizon, 20'000);
  EXPECT_FALSE(look({{0, 0, 60}, {horizon - 10, 0, 50}}, air).blocked);
  const Sight beyond = look({{0, 0, 60}, {horizon + 2000, 0, 50}}, air);
  EXPECT_TRUE(beyond.blocked);
  EXPECT_EQ(beyond.verdict, Verdict::undecided) << "the bound is half a metre";
  const Sight far = look({{0, 0, 60}, {horizon + 9000, 0, 50}}, air);
  EXPECT_EQ(far.verdict, Verdict::hidden);
  EXPECT_FALSE(look({{0, 0, 60}, {horizon + 9000, 0, 50}}, kFlat).blocked) << "negative control";
}

TEST_F(LevelPlain, JudgesByItsBoundAndNotByItsHeightsAlone) {
  const Extraction x = extract(land_.db(), {.error = 0});
  for (const BlendOptions& options : all_blends()) {
    const SightLines lines(land_.db(), x.patches, options);
    for (const double above : {1.0, 0.55, 0.45, 0.3, -0.3, -0.45, -0.55, -1.0}) {
      const SightRay ray{{0, 0, 50 + above}, {900, 20, 50 + above}};
      const Sight s = lines.find({&ray, 1}, kFlat)[0];
      const Verdict expected = above > 0.5    ? Verdict::visible
                               : above < -0.5 ? Verdict::hidden
                                              : Verdict::undecided;
      EXPECT_EQ(s.verdict, expected) << name_of(options) << " " << above;
      EXPECT_EQ(s.blocked, above < 0) << name_of(options) << " " << above;
      EXPECT_NEAR(s.clearance, above, 1e-9) << name_of(options);
      EXPECT_NEAR(s.nearest_bound, 0.5, 1e-9) << name_of(options);
    }
  }
}

TEST_F(LevelPlain, IsNotThereBeyondItsGrids) {
  const Sight beside = look({{0, 5000, 0}, {900, 5000, 0}}, kFlat);
  EXPECT_FALSE(beside.blocked);
  EXPECT_EQ(beside.clearance, INFINITY);
  EXPECT_EQ(beside.verdict, Verdict::visible);
  const Sight into = look({{0, 5000, 49}, {0, 0, 49}}, kFlat);
  EXPECT_TRUE(into.blocked);
  EXPECT_NEAR(into.hit_distance, 5000 - 400, 2e-3) << "at the footprint's edge";
}

TEST_F(LevelPlain, AnswersARayWithoutLength) {
  EXPECT_FALSE(look({{10, 0, 51}, {10, 0, 51}}, kFlat).blocked);
  EXPECT_TRUE(look({{10, 0, 49}, {10, 0, 49}}, kFlat).blocked);
  EXPECT_TRUE(look({{10, 0, 60}, {10, 0, 40}}, kFlat).blocked) << "straight down";
}

}  // namespace
}  // namespace patchwork
