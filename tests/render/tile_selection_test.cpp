// Which tiles are drawn and which wanted, and who shares a slot.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "render/tile_selection.h"
#include "tests/render/woods.h"

namespace patchwork {
namespace {

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

}  // namespace
}  // namespace patchwork
