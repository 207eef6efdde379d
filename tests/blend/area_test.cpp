// Accuracy over areas, and volumes: closed forms, and sums over points one by one.
#include <gtest/gtest.h>

#include "blend/accuracy.h"
#include "blend/volume.h"
#include "tests/blend/scene.h"

namespace patchwork {
namespace {

// Pixels of `step` over an upright extent.
Area area_of(const Extent& e, double step) {
  return {
      .frame = {.x0 = e.xmin + step / 2, .xc = step, .xr = 0, .y0 = e.ymax - step / 2, .yc = 0, .yr = -step},
      .width = int(std::lround((e.xmax - e.xmin) / step)),
      .height = int(std::lround((e.ymax - e.ymin) / step))};
}

GridFile level(double height, double accuracy, double x, double y, int side, double step) {
  return {.width = side,
          .height = side,
          .geotransform = {x - step / 2, step, 0, y + step / 2, 0, -step},
          .pixel_is_area = false,
          .accuracy = accuracy,
          .at = [=](int, int) { return height; }};
}

Blend surface_of(const Database& db, std::vector<std::size_t> places) {
  std::vector<GridId> ids;
  for (const std::size_t k : places) ids.push_back(db.grids()[k].info.id);
  return Blend(db, extract_grids(db, ids).patches, {});
}

// A pit 10 m deep, 400 m wide: before, after, and a plane between.
class Pit : public ::testing::Test {
 protected:
  Pit() : land_({level(100, 0.5, 0, 1000, 101, 10), level(90, 0.2, 300, 700, 81, 5)}) {}
  Land land_;
};

TEST_F(Pit, HoldsTheVolumeBetweenTheSurveysWithWhatTheirBoundsLeaveOpen) {
  const Blend before = surface_of(land_.db(), {0}), after = surface_of(land_.db(), {1});
  const Volume v = volume_between(after, before, area_of({350, 350, 650, 650}, 5));
  EXPECT_NEAR(v.net(), -10 * 300 * 300, 1e-3);
  EXPECT_EQ(v.above.volume, 0);
  EXPECT_NEAR(v.below.area, 300 * 300, 1e-6);
  EXPECT_NEAR(v.error, 0.7 * 300 * 300, 300);
  EXPECT_NEAR(v.below.least, v.below.volume - v.error, 1e-3);
  EXPECT_NEAR(v.below.most, v.below.volume + v.error, 1e-3);
  EXPECT_EQ(v.undecided, 0);
  EXPECT_EQ(v.missing, 0);
}

TEST_F(Pit, CountsWhatOneOfTheSurveysDoesNotReach) {
  const Blend before = surface_of(land_.db(), {0}), after = surface_of(land_.db(), {1});
  const Volume v = volume_between(after, before, area_of({200, 300, 400, 700}, 5));
  EXPECT_NEAR(v.area, 100 * 400, 1e-6);
  EXPECT_NEAR(v.missing, 100 * 400, 1e-6);
}

TEST_F(Pit, StandsOverAPlaneByItsHeightAlone) {
  const Blend before = surface_of(land_.db(), {0});
  const Volume v = volume_over_plane(before, 98, area_of({100, 100, 300, 200}, 10));
  EXPECT_NEAR(v.above.volume, 2 * 200 * 100, 1e-3);
  EXPECT_NEAR(v.error, 0.5 * 200 * 100, 100);
  const Volume close = volume_over_plane(before, 99.7, area_of({100, 100, 300, 200}, 10));
  EXPECT_NEAR(close.undecided, 200 * 100, 1e-6) << "0.3 m are within the bound";
  EXPECT_EQ(close.above.least, 0);
  EXPECT_GT(close.below.most, 0) << "it may even lie below";
}

TEST_F(Pit, KeepsToAnAreaOfAnyShape) {
  Area area = area_of({100, 100, 300, 300}, 1);
  area.inside = [](Point p) { return std::hypot(p.x - 200, p.y - 200) < 80; };
  const Volume v = volume_over_plane(surface_of(land_.db(), {0}), 99, area);
  EXPECT_NEAR(v.above.volume, M_PI * 80 * 80, 0.002 * M_PI * 80 * 80);
}

// Volumes of bilinear cells are exact where the pixels are the cells.
TEST(VolumeOfHills, IsThatOfTheCells) {
  const GridFile file = survey(
      {.width = 61, .height = 51, .geotransform = {0, 10, 0, 1000, 0, -10}, .pixel_is_area = false}, 0);
  const Land land({file});
  double cells = 0;
  for (int j = 10; j < 40; ++j)
    for (int i = 10; i < 50; ++i)
      cells += 100 * 0.25 * (file.at(i, j) + file.at(i + 1, j) + file.at(i, j + 1) + file.at(i + 1, j + 1));
  const Extent e{105, 595, 505, 895};  // of the cells: vertex (i, j) lies at (5 + 10 i, 995 - 10 j)
  const Blend surface = surface_of(land.db(), {0});
  EXPECT_NEAR(volume_over_plane(surface, 0, area_of(e, 10)).net(), cells, 1e-6 * cells);
  EXPECT_GT(std::abs(volume_over_plane(surface, 0, area_of(e, 100)).net() - cells), 1e-5 * cells)
      << "negative control: ten cells a pixel";
}

TEST(GridsAlone, AnswerAsADatabaseOfThemWould) {
  const std::vector<GridFile> all = surveys();
  const Land together(all), alone({all[1]});
  std::mt19937_64 random(test_seed(21));
  const Points points = random_points(alone.db().extent(), 5000, random);
  const GridId id = together.db().grids()[1].info.id;
  const Answers a = evaluate(together.db(), extract_grids(together.db(), {&id, 1}).patches, points);
  const Answers b = evaluate(alone.db(), 0, points), mixed = evaluate(together.db(), 0, points);
  std::size_t answered = 0, others = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    ASSERT_EQ(a.source[k] == 0, b.source[k] == 0);
    if (a.source[k] == 0) continue;
    ++answered, others += std::abs(mixed.source[k]) != 2;
    ASSERT_NEAR(a.height[k], b.height[k], 1e-9);
    ASSERT_LE(std::abs(a.height[k] - hills(points.x[k], points.y[k])), a.bound[k]);
  }
  EXPECT_GT(answered, 3000u);
  EXPECT_GT(others, 500u) << "negative control: together other grids speak there too";
}

TEST(GridsAlone, KeepToARegion) {
  const Land land(surveys());
  const GridId id = land.db().grids()[0].info.id;
  const Region region = Region::inside(Extent{300, 300, 400, 400});
  const Extraction some = extract_grids(land.db(), {&id, 1}, region),
                   all = extract_grids(land.db(), {&id, 1});
  EXPECT_LT(some.patches.size(), all.patches.size());
  for (const PatchId p : all.patches)
    EXPECT_EQ(std::count(some.patches.begin(), some.patches.end(), p) == 1,
              region.meets(land.db().grid(id), {p.level(), p.bx(), p.by()}));
}

TEST(AccuracyOverAnArea, IsThatOfItsPointsOneByOne) {
  const Land land(surveys());
  const Blend surface(land.db(), extract(land.db(), {.error = 0}).patches, {});
  const Area area = area_of({-50, 200, 1500, 1500}, 12.5);
  const Accuracy a = accuracy_over(surface, area, land.db().grids().size());
  std::vector<double> bounds, by_source(land.db().grids().size());
  std::size_t missing = 0;
  double sum = 0;
  for (int r = 0; r < area.height; ++r)
    for (int c = 0; c < area.width; ++c) {
      const Point p = area.centre(c, r);
      double bound;
      std::int32_t source;
      surface.at_points({&p.x, 1}, {&p.y, 1},
                        {.height = {}, .bound = {&bound, 1}, .source = {&source, 1}, .patch = {}});
      if (source == 0) {
        ++missing;
        continue;
      }
      bounds.push_back(bound), sum += bound, by_source[std::size_t(std::abs(source)) - 1] += area.pixel();
    }
  std::sort(bounds.begin(), bounds.end());
  EXPECT_EQ(a.best.bound, bounds.front());
  EXPECT_EQ(a.worst.bound, bounds.back());
  EXPECT_NEAR(a.mean, sum / double(bounds.size()), 1e-9);
  EXPECT_NEAR(a.answered, double(bounds.size()) * area.pixel(), 1e-3);
  EXPECT_NEAR(a.missing, double(missing) * area.pixel(), 1e-3);
  EXPECT_GT(missing, 0u);
  for (std::size_t g = 0; g < by_source.size(); ++g) EXPECT_NEAR(a.by_source[g], by_source[g], 1e-3);
  const double median = bounds[bounds.size() / 2], p95 = bounds[bounds.size() * 95 / 100];
  EXPECT_NEAR(a.median, median, 0.011 * median);
  EXPECT_NEAR(a.p95, p95, 0.011 * p95);
  double at = NAN;
  surface.at_points({&a.worst.at.x, 1}, {&a.worst.at.y, 1},
                    {.height = {}, .bound = {&at, 1}, .source = {}, .patch = {}});
  EXPECT_EQ(at, a.worst.bound) << "where it says";
}

TEST(AccuracyOverAnArea, IsNoneWhereThereIsNoData) {
  const Land land(surveys());
  const Blend surface(land.db(), extract(land.db(), {.error = 0}).patches, {});
  const Accuracy a = accuracy_over(surface, area_of({9000, 9000, 9100, 9100}, 10), land.db().grids().size());
  EXPECT_TRUE(std::isnan(a.best.bound));
  EXPECT_EQ(a.answered, 0);
  EXPECT_NEAR(a.missing, 10000, 1e-6);
}

}  // namespace
}  // namespace patchwork
