// Where tiles lie, and what their levels and patches answer there.
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "blend/placed.h"
#include "render/tile_cut.h"
#include "render/tile_patches.h"
#include "tests/render/woods.h"

namespace patchwork {
namespace {

TEST(TileLattice, TheRootHoldsAllDataAndChildrenAreQuarters) {
  const TileLattice t = TileLattice::over(land().db());
  const Extent root = t.bounds(t.root()), data = land().db().extent();
  EXPECT_LE(root.xmin, data.xmin);
  EXPECT_LE(root.ymin, data.ymin);
  EXPECT_GE(root.xmax, data.xmax);
  EXPECT_GE(root.ymax, data.ymax);
  for (const TileKey& k : {TileKey{5, 3, 2}, TileKey{1, 0, 7}})
    for (int c = 0; c < 4; ++c) {
      const Extent whole = t.bounds(k), part = t.bounds(k.child(c));
      EXPECT_EQ(k.child(c).parent(), k);
      EXPECT_DOUBLE_EQ(c & 1 ? part.xmax : part.xmin, c & 1 ? whole.xmax : whole.xmin);
      EXPECT_DOUBLE_EQ(c >> 1 ? part.ymax : part.ymin, c >> 1 ? whole.ymax : whole.ymin);
      EXPECT_EQ(t.first_x(k.child(c)), t.first_x(k) + (c & 1) * (TileLattice::kCells << k.level));
    }
  for (int l = 1; l < t.levels(); ++l) EXPECT_GE(t.error(l), t.error(l - 1));
  EXPECT_EQ(t.error(0), 0) << "the finest level answers with the best there is";
}

// Otherwise what its samples do one by one would go unseen between half cells.
TEST(TileLattice, VerticesOfAnUprightGridsPatchesAreHalfCellsOfTiles) {
  for (const bool area : {true, false})
    for (const int width : {2000, 2049, 3001}) {
      GridFile file = survey({.width = width, .height = 40, .geotransform = {4005, 10, 0, 7213, 0, -10}}, 0);
      file.pixel_is_area = area;
      const Land one({file});
      const TileLattice t = TileLattice::over(one.db());
      EXPECT_TRUE(t.fits(one.db()));
      int seen = 0;
      for (int level = 0; level < t.levels(); ++level) {
        const double half = 0.5 * t.step(level);
        for (int q = 0; q < 8; ++q) {
          if (std::ldexp(10, q) < half) continue;
          const Point vertex = one.db().grids()[0].info.frame.to_domain(3 << q, 5 << q);
          const double x = (vertex.x - t.origin().x) / half, y = (vertex.y - t.origin().y) / half;
          EXPECT_NEAR(x, std::round(x), 1e-9);
          EXPECT_NEAR(y, std::round(y), 1e-9);
          ++seen;
        }
      }
      EXPECT_GE(seen, 60);
    }
}

TEST(TileCut, FindsWhatAUniformCutOverEachPlaceFinds) {
  const Database& db = land().db();
  std::mt19937_64 random(test_seed(3));
  std::uniform_real_distribution<double> x(0, 1800), size(10, 200), error(0, 30);
  for (int n = 0; n < 50; ++n) {
    std::vector<Extent> places;
    std::set<PatchId> wanted;
    const double e = error(random);
    for (int k = 0; k < 3; ++k) {
      const double px = x(random), py = x(random), s = size(random);
      places.push_back({px, py, px + s, py + s});
      const UniformCut cut{.error = e, .region = Region::inside(places.back())};
      for (const PatchId id : extract(db, cut).patches) wanted.insert(id);
    }
    const Extraction found = extract(db, TileCut(e, places));
    EXPECT_EQ(std::set<PatchId>(found.patches.begin(), found.patches.end()), wanted);
  }
}

TEST(TileCut, NothingBetterThanTheBestAndSomethingBetterThanTheCoarsest) {
  const Database& db = land().db();
  const Extent place{400, 700, 500, 800};
  const auto sorted = [&](double e) {
    std::vector<PatchId> ids = extract(db, {.error = e}).patches;
    std::sort(ids.begin(), ids.end());
    return ids;
  };
  EXPECT_FALSE(is_improvable(db, sorted(0), place));
  EXPECT_TRUE(is_improvable(db, sorted(1e6), place));
}

// With one grid its accuracy stays: with several another one's may be the best.
TEST(TilePatches, BlocksAreNoFartherFromTheBestSurfaceThanTheirPatchesSay) {
  const std::vector<GridFile> grids = surveys();
  std::mt19937_64 random(test_seed(71));
  for (const bool alone : {true, false}) {
    const Land some(alone ? std::vector<GridFile>{grids[0]} : grids);
    const Database& db = some.db();
    const TileLattice lattice = TileLattice::over(db);
    const Blend best(db, extract(db, {.error = 0}).patches, {.smoothness = 1});
    std::size_t blocks = 0, tight = 0, unreached = 0;
    double most = 0;
    for (int n = 0; n < 40; ++n) {
      const int level = lattice.levels() - 1 - int(random() % 5), side = 1 << (lattice.levels() - 1 - level);
      const TileKey key{level, int(random() % std::uint64_t(side)), int(random() % std::uint64_t(side))};
      const Extraction x = extract(db, TileCut(lattice.error(level), {with_halo(lattice, key)}));
      if (x.patches.empty()) continue;
      std::vector<PatchId> ids = x.patches;
      std::sort(ids.begin(), ids.end());
      std::vector<Blend::Placed> placed;
      for (const PatchId id : ids) placed.push_back(place(db, id, 1));
      const Extent e = lattice.bounds(key);
      const TilePatches told = TilePatches::of(db, placed, ids, lattice, key);
      const Blend own(db, x.patches, {.smoothness = 1});
      for (int b = 0; b < 64; ++b) {
        const double width = (e.xmax - e.xmin) / 8;
        const Extent block{e.xmin + b % 8 * width, e.ymin + b / 8 * width, e.xmin + (b % 8 + 1) * width,
                           e.ymin + (b / 8 + 1) * width};
        const Points points = random_points(block, 60, random);
        Answers here(points.size()), there(points.size());
        own.at_points(points.x, points.y, here.out()), best.at_points(points.x, points.y, there.out());
        const TilePatches::Block& lack = told.blocks[std::size_t(b)];
        for (std::size_t k = 0; k < points.size(); ++k) {
          if (here.source[k] == 0) continue;
          ASSERT_TRUE(told.blocks[std::size_t(b)].reached());
          const double apart = std::abs(here.height[k] - there.height[k]);
          const double reducible = std::max(0.0, here.bound[k] - double(lack.lasting));
          // What the best may be off is its own: of one grid, what a smooth surface departs from a bilinear
          // one.
          const double own_bound = alone ? there.bound[k] - db.grids()[0].info.accuracy : there.bound[k];
          ASSERT_LE(apart, own_bound + reducible + 1e-9);
          most = std::max(most, apart), tight += reducible < here.bound[k];
        }
        ++blocks, unreached += !told.blocks[std::size_t(b)].reached();
      }
    }
    EXPECT_GT(blocks, 500u);
    EXPECT_GT(most, 1.0);
    EXPECT_GT(tight, 1000u);
    EXPECT_GT(unreached, 50u);
  }
}

}  // namespace
}  // namespace patchwork
