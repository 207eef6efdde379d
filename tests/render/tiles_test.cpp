// Tiles of a quadtree: where they lie, which are drawn, which share a slot, who owns the vertices of their
// seams.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "blend/placed.h"
#include "render/tile_cut.h"
#include "render/tile_patches.h"
#include "render/tile_seams.h"
#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

const Land& land() {
  static const Land l(surveys());
  return l;
}

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

TEST(TileCache, GivesNoSlotOfThisFrameAwayAndKnowsWhoHasWhich) {
  std::mt19937_64 random(test_seed(5));
  for (const TilePolicy policy : {TilePolicy::first, TilePolicy::lru, TilePolicy::lru_error}) {
    TileCache cache(8, policy);
    std::set<TileKey> used;
    for (int n = 0; n < 2000; ++n) {
      if (n % 7 == 0) cache.begin_selection(), used.clear();
      const TileKey key{0, int(random() % 6), int(random() % 5)};
      const TileCache::Node* node = cache.find(key);
      if (node && node->drawable()) {
        cache.use(key, double(random() % 10));
        used.insert(key);
      } else {
        const std::uint32_t slot = cache.take_slot(key);
        if (slot == TileCache::kNoSlot) {
          EXPECT_EQ(used.size(), 8u) << "all of them are used in this frame";
          continue;
        }
        cache.put(key, {}, slot);
        used.insert(key);
      }
      ASSERT_EQ(cache.find_violation(), "");
      for (const TileKey& k : used) ASSERT_TRUE(cache.find(k)->drawable());
    }
    EXPECT_GT(cache.evictions(), 100u);
  }
}

TEST(TileCache, TheLeastRecentlyUsedGoesFirst) {
  TileCache cache(2, TilePolicy::lru);
  const TileKey a{0, 0, 0}, b{0, 1, 0}, c{0, 2, 0};
  cache.put(a, {}, cache.take_slot(a));
  cache.put(b, {}, cache.take_slot(b));
  cache.begin_selection();
  cache.use(a, 1);
  cache.begin_selection();
  cache.put(c, {}, cache.take_slot(c));
  EXPECT_TRUE(cache.find(a)->drawable());
  EXPECT_EQ(cache.find(b), nullptr);
}

// A cache in which tiles of random roughness exist, to a random depth, whatever the terrain.
class Woods {
 public:
  explicit Woods(std::uint64_t seed) : random_(seed), lattice_(TileLattice::over(land().db())) {
    grow(lattice_.root(), 1);
  }

  const TileLattice& lattice() const { return lattice_; }
  TileCache cache{4000, TilePolicy::lru};

  Camera camera() {
    const Extent e = land().db().extent();
    std::uniform_real_distribution<double> x(e.xmin, e.xmax), y(e.ymin, e.ymax), z(320, 800), d(-500, 500);
    const Point3 eye{x(random_), y(random_), z(random_)};
    return {eye, {eye.x + d(random_), eye.y + d(random_), eye.z - 200}, 60, 640, 360};
  }

 private:
  void grow(const TileKey& key, double share) {
    const auto chance = [&](double p) { return double(random_() % 1000) < 1000 * p; };
    if (key.level + 3 < lattice_.levels() && chance(0.05)) {
      cache.put(key, {}, TileCache::kNoSlot);
      return;
    }
    TileFacts f;
    f.lowest = 200, f.highest = 400, f.holes = (key.x + 3 * key.y + key.level) % 11 == 0;
    for (TileFacts::Part& part : f.parts) {
      part = {lattice_.step(key.level) * 0.1 * (0.2 + double(random_() % 100) / 50), {200, 400}};
      f.error = std::max(f.error, part.error);
    }
    cache.put(key, f, cache.take_slot(key));
    if (key.level > lattice_.levels() - 7 && chance(share))
      for (int c = 0; c < 4; ++c) grow(key.child(c), 0.9);
  }
  std::mt19937_64 random_;
  TileLattice lattice_;
};

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

// What is seen of a tile decides, and where in it: not its worst place.
TEST(TileSelection, APartOutOfSightDoesNotSplitATile) {
  const TileLattice lattice = TileLattice::over(land().db());
  const TileKey root = lattice.root();
  const Extent e = lattice.bounds(root);
  const double side = e.xmax - e.xmin;
  TileFacts facts;
  facts.lowest = 200, facts.highest = 400;
  for (int y = 0; y < 4; ++y)  // those around the eye are flat
    for (int x = 0; x < 4; ++x) facts.part(x, y) = {x % 3 == 0 || y % 3 == 0 ? 0.01 : 0, {200, 400}};
  facts.part(3, 3).error = facts.error = 50;
  const auto reached = [&](double look_x, double look_y) {
    TileCache cache{16, TilePolicy::lru};
    cache.put(root, facts, cache.take_slot(root));
    Selection selection;
    // From the middle of the root.
    const Point3 eye{e.xmin + side / 2, e.ymin + side / 2, 450};
    const Camera camera{eye, {eye.x + look_x, eye.y + look_y, 440}, 60, 640, 360};
    select_tiles(lattice, Frustum(camera), {.pixel_error = 1}, cache, selection);
    EXPECT_EQ(selection.wanted.empty(), selection.pixels <= 1);
    EXPECT_EQ(selection.drawn.size(), 1u);
    return selection.pixels;
  };
  const double away = reached(-100, -100), towards = reached(100, 100);
  EXPECT_LE(away, 1);
  EXPECT_GT(towards, 5);
  EXPECT_LT(towards, 1000) << "though all of the tile lies around the eye";
}

// By a millimetre up and down anywhere in a box where the picture shows it.
TEST(Frustum, AVerticalMetreInABoxTakesNoMorePixelsThanItSays) {
  std::mt19937_64 random(test_seed(17));
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::size_t seen = 0;
  double tightest = 0, sum = 0;
  for (int n = 0; n < 20000; ++n) {
    const Point3 eye{uniform(-500, 500), uniform(-500, 500), uniform(0, 500)};
    const Camera camera{eye,
                        {eye.x + uniform(-1, 1), eye.y + uniform(-1, 1), eye.z + uniform(-1.5, 0.7)},
                        uniform(20, 100),
                        640,
                        360};
    const Frustum frustum(camera);
    const double x = uniform(-1000, 1000), y = uniform(-1000, 1000), z = uniform(-100, 300),
                 s = uniform(1, 80);
    const Box3 box{{x, y, x + s, y + s}, z, z + uniform(0, 50)};
    if (!frustum.sees(box) || !std::isfinite(frustum.pixels_per_metre(box))) continue;
    const double allowed = frustum.pixels_per_metre(box);
    double most = 0;
    for (int k = 0; k < 12; ++k) {
      const Point3 p{uniform(x, x + s), uniform(y, y + s), uniform(z, box.highest)};
      const Seen here = see(camera, p);
      if (here.axial <= 0 || here.x < 0 || here.y < 0 || here.x > camera.width || here.y > camera.height)
        continue;
      const Seen low = see(camera, {p.x, p.y, p.z - 1e-3}), high = see(camera, {p.x, p.y, p.z + 1e-3});
      most = std::max(most, std::hypot(high.x - low.x, high.y - low.y) / 2e-3);
    }
    if (most == 0) continue;
    ++seen, sum += most / allowed, tightest = std::max(tightest, most / allowed);
    ASSERT_LE(most, allowed * 1.0001) << "box " << n;
  }
  EXPECT_GT(seen, 500u);
  EXPECT_GT(tightest, 0.9) << "and not many more";
  std::printf("%zu boxes, %.2f of it on average\n", seen, sum / double(seen));
}

TEST(TileSelection, CoversTheRootOnceAndNeighboursDifferByOneLevel) {
  const std::uint64_t seed = test_seed(7);
  int differing = 0;
  for (std::uint64_t n = 0; n < 40; ++n) {
    Woods woods(seed + n);
    const Frustum frustum(woods.camera());
    Selection s;
    select_tiles(woods.lattice(), frustum, {.pixel_error = 1}, woods.cache, s);
    double area = 0;
    for (const auto& [key, place] : s.tiles) {
      if (place == Selection::kSplit) {
        for (int c = 0; c < 4; ++c) EXPECT_TRUE(s.tiles.contains(key.child(c)));
        continue;
      }
      area += std::ldexp(1.0, 2 * key.level);
      if (!s.leaves[place].drawn) continue;
      for (int side = 0; side < 4; ++side) {
        const TileKey beside = key.beside(side);
        if (!woods.lattice().contains(beside) || s.tiles.contains(beside)) continue;
        ++differing;
        const auto larger = s.tiles.find(beside.parent());
        if (larger == s.tiles.end()) {  // in something out of sight
          const Selection::Leaf* leaf = s.leaf_at(beside, 0, 0);
          EXPECT_FALSE(leaf->drawn);
        }
      }
    }
    EXPECT_EQ(area, std::ldexp(1.0, 2 * woods.lattice().root().level));
  }
  EXPECT_GT(differing, 100);
}

TEST(TileSelection, WhatIsTooRoughIsWantedAndTheErrorReachedIsTold) {
  Woods woods(test_seed(9));
  const Frustum frustum(woods.camera());
  Selection s;
  select_tiles(woods.lattice(), frustum, {.pixel_error = 1e-6}, woods.cache, s);
  EXPECT_GT(s.pixels, 1e-6);
  EXPECT_FALSE(s.wanted.empty());
  double worst = 0;
  for (const std::uint32_t k : s.drawn)
    if (s.leaves[k].key.level > 0) worst = std::max(worst, s.leaves[k].pixels);
  EXPECT_EQ(worst, s.pixels);
  Selection few;
  select_tiles(woods.lattice(), frustum, {.pixel_error = 1e-6, .most_tiles = 20}, woods.cache, few);
  EXPECT_LE(few.drawn.size(), 20u);
  EXPECT_GE(few.pixels, s.pixels) << "a smaller pool is a coarser picture, and says so";
}

TEST(TileSelection, NeverDrawsMoreThanItMay) {
  const std::uint64_t seed = test_seed(19);
  std::size_t full = 0;
  for (std::uint64_t n = 0; n < 60; ++n) {
    Woods woods(seed + n);
    const Frustum frustum(woods.camera());
    for (std::size_t most = 4; most < 80; most += 3) {
      Selection s;
      select_tiles(woods.lattice(), frustum, {.pixel_error = 1e-6, .most_tiles = most}, woods.cache, s);
      ASSERT_LE(s.drawn.size(), most);
      full += s.drawn.size() + 3 > most;
    }
  }
  EXPECT_GT(full, 300u) << "and takes what it may";
}

// What is used and what is wanted fit into the cache together, and what is left out is not the worst.
TEST(TileSelection, WantsNoMoreThanThereAreSlotsFor) {
  const std::uint64_t seed = test_seed(27);
  std::size_t full = 0;
  for (std::uint64_t n = 0; n < 60; ++n) {
    Woods woods(seed + n);
    const Frustum frustum(woods.camera());
    Selection all;
    select_tiles(woods.lattice(), frustum, {.pixel_error = 1e-6}, woods.cache, all);
    for (std::size_t slots = 4; slots < 120; slots += 7) {
      Selection s;
      select_tiles(woods.lattice(), frustum, {.pixel_error = 1e-6, .slots = slots}, woods.cache, s);
      std::set<TileKey> wanted;
      for (const Selection::Wanted& w : s.wanted) EXPECT_TRUE(wanted.insert(w.key).second) << "once";
      std::size_t held = wanted.size();
      for (const auto& [key, place] : s.tiles) held += woods.cache.find(key)->drawable();
      ASSERT_LE(held, slots);
      full += held + 4 > slots;
      EXPECT_GE(s.pixels, all.pixels);
    }
  }
  EXPECT_GT(full, 300u) << "and takes what it may";
}

// A change makes stale what it touches. Of that, what is in sight is wanted: behind all that is missing, and
// what is not drawn itself at last.
TEST(TileSelection, WhatAChangeTouchesIsWantedBehindWhatIsMissing) {
  const std::uint64_t seed = test_seed(15);
  std::size_t touched = 0, split = 0, hidden = 0;
  for (std::uint64_t n = 0; n < 20; ++n) {
    Woods woods(seed + n);
    const Frustum frustum(woods.camera());
    Selection before, after;
    const SelectionOptions options{.pixel_error = 1, .heights = {-2000, 600}};
    select_tiles(woods.lattice(), frustum, options, woods.cache, before);
    const Extent change{500, 600, 900, 1100};
    std::set<TileKey> stale;
    for (const auto& [key, place] : before.tiles) {
      Extent e = woods.lattice().bounds(key);
      const double halo = woods.lattice().step(key.level);
      e.xmin -= halo, e.ymin -= halo, e.xmax += halo, e.ymax += halo;
      if (!e.meets(change)) continue;
      const TileCache::Node& node = *woods.cache.find(key);
      const Box3 around{woods.lattice().bounds(key), node.facts.lowest - node.facts.error,
                        node.facts.highest + node.facts.error};
      const bool shown = !node.empty && frustum.sees(around);
      const bool may_be = frustum.sees({around.place, options.heights.lowest, options.heights.highest});
      if (shown || may_be) stale.insert(key);
      hidden += !shown && may_be && !node.empty;
    }
    woods.cache.invalidate(woods.lattice(), change);
    select_tiles(woods.lattice(), frustum, options, woods.cache, after);
    EXPECT_EQ(after.tiles.size(), before.tiles.size()) << "old tiles are drawn meanwhile";
    ASSERT_EQ(after.wanted.size(), before.wanted.size() + stale.size());
    for (std::size_t k = 0; k < after.wanted.size(); ++k) {
      const TileKey& key = after.wanted[k].key;
      if (k < before.wanted.size()) {
        EXPECT_EQ(key, before.wanted[k].key) << "what is missing comes first";
        continue;
      }
      EXPECT_TRUE(stale.contains(key));
      const bool drawn = after.tiles.at(key) != Selection::kSplit;
      EXPECT_EQ(after.wanted[k].pixels >= 0, drawn);
      ++touched, split += !drawn;
    }
  }
  EXPECT_GT(touched, 50u);
  EXPECT_GT(split, 20u);
  EXPECT_GT(hidden, 5u) << "out of sight as they were";
}

// ---- seams
// ---------------------------------------------------------------------------------------------------

// terrain.glsl in C++: the texel of a border position, and where in the lattice it lies.
std::uint32_t half_texel(const TileDraw& d, int s, int t) {
  const TileDraw::Side& side = d.sides[std::size_t(s)];
  const std::uint32_t later = t > 64, past = std::uint32_t(t) - 64 * later;
  return (later ? side.far : side.near) + (side.fine >> later & 1 ? past : past / 2) * side.step;
}

std::uint32_t seam_texel(const TileDraw& d, int s, int t) {
  if (t == 0 || t == 128) {
    const int along = t == 0 ? 0 : 1;
    return d.corners[std::size_t(s < 2 ? s + 2 * along : along + 2 * (s - 2))];
  }
  return t == 64 ? d.middles[std::size_t(s)] : half_texel(d, s, t);
}

std::pair<std::int64_t, std::int64_t> place_of(const TileDraw& d, int s, int t) {
  const std::int64_t along = std::int64_t(d.stride) * t, across = std::int64_t(d.stride) * 128 * (s & 1);
  return s < 2 ? std::pair{d.x + across, d.y + along} : std::pair{d.x + along, d.y + across};
}

// What some camera draws of some woods.
struct DrawnWoods {
  Woods woods;
  Selection selection;
  std::vector<TileDraw> draws;

  explicit DrawnWoods(std::uint64_t seed) : woods(seed) {
    const Camera camera = woods.camera();
    select_tiles(woods.lattice(), Frustum(camera), {.pixel_error = 1}, woods.cache, selection);
    make_draws(woods.lattice(), selection, woods.cache, {camera.eye.x, camera.eye.y}, draws);
  }
};

TEST(EdgeSplit, WhoeverSharesAVertexReadsTheSameTexel) {
  const std::uint64_t seed = test_seed(11);
  int shared = 0, finer = 0, apart = 0;
  for (std::uint64_t n = 0; n < 40; ++n) {
    const DrawnWoods seen(seed + n);
    const std::vector<TileDraw>& draws = seen.draws;
    ASSERT_EQ(draws.size(), seen.selection.drawn.size());
    std::map<std::pair<std::int64_t, std::int64_t>, std::uint32_t> texel_at, half_texel_at;
    for (const TileDraw& d : draws)
      for (int side = 0; side < 4; ++side)
        for (int t = 0; t <= 128; ++t) {
          const bool fine = d.sides[std::size_t(side)].fine >> (t > 64) & 1;
          if (t % 2 && !fine) continue;  // no vertex there
          finer += fine;
          const auto [at, is_new] = texel_at.try_emplace(place_of(d, side, t), seam_texel(d, side, t));
          ASSERT_EQ(at->second, seam_texel(d, side, t)) << "side " << side << " position " << t;
          shared += !is_new;
          const std::uint32_t own = half_texel(d, side, t);
          apart += half_texel_at.try_emplace(place_of(d, side, t), own).first->second != own;
        }
  }
  EXPECT_GT(shared, 10000);
  EXPECT_GT(finer, 1000) << "levels meet";
  report_law("EdgeSplit", "whoever shares a vertex reads the same texel", std::uint64_t(shared));
  report_control("EdgeSplit", "halves of seams read their ends themselves", std::uint64_t(shared), apart, 0,
                 "vertices");
}

// Its fragments must be asked whether they have data.
TEST(TileSeams, WhoSharesAVertexWithATileWithHolesCountsAsOneWithHoles) {
  const std::uint64_t seed = test_seed(21);
  std::size_t own = 0, shared = 0, solid = 0;
  for (std::uint64_t n = 0; n < 20; ++n) {
    const DrawnWoods seen(seed + n);
    const std::vector<TileDraw>& draws = seen.draws;
    std::set<std::uint32_t> holed;
    for (const std::uint32_t k : seen.selection.drawn) {
      const TileCache::Node& node = *seen.woods.cache.find(seen.selection.leaves[k].key);
      if (node.facts.holes) holed.insert(node.slot);
    }
    EXPECT_TRUE(std::is_sorted(draws.begin(), draws.end(),
                               [](const TileDraw& a, const TileDraw& b) { return a.holes < b.holes; }));
    for (const TileDraw& d : draws) {
      bool reads = holed.contains(d.slot);
      for (int side = 0; side < 4; ++side)
        for (int t = 0; t <= 128; ++t)
          if (t % 2 == 0 || d.sides[std::size_t(side)].fine >> (t > 64) & 1)
            reads |= holed.contains(seam_texel(d, side, t) / (65 * 65));
      ASSERT_EQ(d.holes != 0, reads);
      own += holed.contains(d.slot), shared += reads && !holed.contains(d.slot), solid += !reads;
    }
  }
  EXPECT_GT(own, 20u);
  EXPECT_GT(shared, 20u);
  EXPECT_GT(solid, 20u);
}

// What a block at a border needs, whoever lies beyond.
int own_need(const std::vector<std::array<int, 64>>& need, std::size_t d, int side, int along) {
  const int end = (side & 1) * 7;
  return need[d][std::size_t(side < 2 ? along * 8 + end : end * 8 + along)];
}

// factor_edges.comp in C++: the segments of each border edge, in the terms of its tile, from what blocks
// need.
int border_need(const std::vector<TileDraw>& draws, const std::vector<std::array<int, 64>>& need,
                std::size_t d, int s, int along) {
  const auto at = [&](std::size_t draw, int side, int k) { return own_need(need, draw, side, k); };
  const int own = at(d, s, along);
  const std::uint32_t other = (along < 4 ? draws[d].beside_near : draws[d].beside_far)[std::size_t(s)];
  if (other == TileDraw::kAlone) return own;
  const std::size_t number = other & 0x1fffffffu;
  if (other & TileDraw::kFiner) {
    const int first = 2 * (along % 4);
    return std::max(own, 2 * std::max(at(number, s ^ 1, first), at(number, s ^ 1, first + 1)));
  }
  if (other & TileDraw::kLarger) {
    const int theirs = (other & TileDraw::kSecondHalf ? 4 : 0) + along / 2;
    return std::max(at(number, s ^ 1, theirs), 2 * std::max(own, at(d, s, along ^ 1))) / 2;
  }
  return std::max(own, at(number, s ^ 1, along));
}

TEST(EdgeSplit, EverySharedEdgeIsSplitAtTheSamePlaces) {
  const std::uint64_t seed = test_seed(13);
  std::size_t edges = 0, split_apart = 0;
  for (std::uint64_t n = 0; n < 40; ++n) {
    const DrawnWoods seen(seed + n);
    const std::vector<TileDraw>& draws = seen.draws;
    std::mt19937_64 random(seed + n);
    std::vector<std::array<int, 64>> need(draws.size());
    for (auto& tile : need)
      for (int& b : tile) b = 1 << random() % 4;
    // Segments of shared lines: each must be there twice, from either side.
    using Place = std::pair<std::int64_t, std::int64_t>;
    std::map<std::pair<Place, Place>, int> segments, by_own_need;
    for (std::size_t d = 0; d < draws.size(); ++d)
      for (int side = 0; side < 4; ++side)
        for (int along = 0; along < 8; ++along) {
          const std::uint32_t other =
              (along < 4 ? draws[d].beside_near : draws[d].beside_far)[std::size_t(side)];
          if (other == TileDraw::kAlone) continue;
          const auto split = [&](int parts, auto& into) {
            for (int k = 0; k < parts; ++k)
              ++into[{place_of(draws[d], side, 16 * along + 16 * k / parts),
                      place_of(draws[d], side, 16 * along + 16 * (k + 1) / parts)}];
          };
          split(border_need(draws, need, d, side, along), segments);
          split(own_need(need, d, side, along), by_own_need);
        }
    for (const auto& [segment, times] : segments) ASSERT_EQ(times, 2);
    edges += segments.size();
    for (const auto& [segment, times] : by_own_need) split_apart += times != 2;
  }
  EXPECT_GT(edges, 10000u);
  report_law("EdgeSplit", "both sides split a shared edge at the same places", edges);
  report_control("EdgeSplit", "each side splits by its own need", edges, double(split_apart), 0, "edges");
}

}  // namespace
}  // namespace patchwork
