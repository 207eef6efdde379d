// Who owns the vertices of tiles' seams, and where shared edges are split.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "render/tile_seams.h"
#include "tests/hard_case.h"
#include "tests/render/woods.h"

namespace patchwork {
namespace {

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
