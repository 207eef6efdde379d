// The mesh that compute shaders make of the terrain: no gap, no vertex inside an edge, what hardware shows.
#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <numeric>
#include <set>

#include "render/tile_seams.h"
#include "tests/hard_case.h"
#include "tests/render/terrain_views.h"

namespace patchwork {
namespace {

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

// Of a frame's mesh: a vertex inside an edge of a triangle would tear it open.
struct Seams {
  std::size_t edges = 0, torn = 0, levels = 0;
  // Half cells^2, twice; by draw and block, and by the first of four where triangles lie in several of these.
  std::map<std::pair<std::uint32_t, int>, std::int64_t> area, quads;
};

// The block that a triangle lies in; the first of four, and that it lies in several of them.
struct BlockOf {
  explicit BlockOf(const MeshVertex* v) {
    const auto [west, east] = std::minmax({v[0].x, v[1].x, v[2].x});
    const auto [south, north] = std::minmax({v[0].y, v[1].y, v[2].y});
    several = west / 16 != (east - 1) / 16 || south / 16 != (north - 1) / 16;
    block = west / 16 + south / 16 * 8, first = block & ~9;
  }
  int block, first;
  bool several;
};

Seams seams_of(const std::vector<MeshVertex>& mesh, std::span<const TileDraw> draws) {
  using Place = std::array<std::int64_t, 2>;
  const auto place = [&](std::uint32_t d, std::int64_t x, std::int64_t y) {
    return Place{draws[d].x + x * draws[d].stride, draws[d].y + y * draws[d].stride};
  };
  std::set<Place> vertices;
  std::set<std::uint32_t> strides;
  for (const auto& v : mesh) vertices.insert(place(v.draw, v.x, v.y)), strides.insert(draws[v.draw].stride);
  Seams s;
  s.levels = strides.size();
  for (std::size_t t = 0; t < mesh.size(); t += 3)
    if (const BlockOf in(&mesh[t]); in.several) s.quads[{mesh[t].draw, in.first}] = 0;
  for (std::size_t t = 0; t < mesh.size(); t += 3) {
    const MeshVertex *a = &mesh[t], *b = a + 1, *c = a + 2;
    const std::int64_t twice =
        std::int64_t(b->x - a->x) * (c->y - a->y) - std::int64_t(c->x - a->x) * (b->y - a->y);
    EXPECT_GT(twice, 0);
    const BlockOf in(a);
    const auto quad = s.quads.find({a->draw, in.first});
    (quad != s.quads.end() ? quad->second : s.area[{a->draw, in.block}]) += twice;
    for (int k = 0; k < 3; ++k) {
      const MeshVertex &from = mesh[t + std::size_t(k)], &to = mesh[t + std::size_t((k + 1) % 3)];
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
  std::size_t edges = 0, torn = 0, levels = 0, blocks = 0, quads = 0;
  for (const double tau : {0.5, 2.0, 8.0}) {
    Renderer r = renderer(tau, Tessellation::mesh);
    for (int n = 0; n < 8; ++n) {
      const FrameStats stats = r.draw(random_camera(db(), random));
      const auto mesh = r.mesh();
      EXPECT_LE(stats.triangles, mesh.size() / 3);
      const Seams s = seams_of(mesh, r.drawn().draws);
      for (const auto& [block, twice] : s.area) EXPECT_EQ(twice, 2 * 16 * 16);
      for (const auto& [quad, twice] : s.quads) EXPECT_EQ(twice, 2 * 32 * 32);
      blocks += s.area.size(), quads += s.quads.size();
      edges += s.edges, torn += s.torn, levels = std::max(levels, s.levels);
    }
  }
  EXPECT_GT(edges, 50000u);
  EXPECT_GT(levels, 3u);
  EXPECT_GT(blocks, 1000u);
  EXPECT_GT(quads, 500u);
  report_case("EdgeSplit", "edges of 24 meshes with a vertex inside", edges, double(torn), 0, "edges");
}

// Where levels have data.
class LevelData {
 public:
  LevelData(const Database& db, const TileLattice& lattice) : db_(db), lattice_(lattice) {}
  // Of the half cells of a tile, row by row.
  std::vector<bool> of(const TileKey& key) {
    Points points;
    for (int y = 0; y < TileLattice::kSamples; ++y)
      for (int x = 0; x < TileLattice::kSamples; ++x) points.add(place(key, x, y));
    return at(key.level, points);
  }
  // At a half cell of a tile, as another level answers.
  bool at(const TileKey& key, int x, int y, int level) {
    Points points;
    points.add(place(key, x, y));
    return at(level, points)[0];
  }

 private:
  Point place(const TileKey& key, int x, int y) const {
    return lattice_.frame().at(lattice_.first_x(key) + (x << key.level),
                               lattice_.first_y(key) + (y << key.level));
  }
  std::vector<bool> at(int level, const Points& points) {
    auto& blend = blends_[level];
    if (!blend)
      blend = std::make_unique<Blend>(db_, extract(db_, {.error = lattice_.error(level)}).patches,
                                      BlendOptions{.smoothness = 1});
    Answers answers(points.size());
    blend->at_points(points.x, points.y, answers.out());
    std::vector<bool> data;
    for (const auto source : answers.source) data.push_back(source != 0);
    return data;
  }
  const Database& db_;
  const TileLattice& lattice_;
  std::map<int, std::unique_ptr<Blend>> blends_;
};

// Around holes, and only there, the mesh is as fine as it gets.
TEST_F(VulkanTest, TrianglesOfAMeshAreWhollyDataOrWhollyHoleOrAsSmallAsTheyGet) {
  GridFile file = survey({.width = 300, .height = 300, .geotransform = {100, 9, 0, 3000, 0, -9}}, 0.1);
  file.nodata = -9999;
  file.at = [at = file.at](int i, int j) {
    // Single samples on borders of tiles: larger ones answer there.
    const bool pond = std::hypot(i - 70, j - 60) < 25;
    const bool pixel = (i % 128 == 0 && (j % 6 == 3 || j % 128 == 0)) || (j % 128 == 0 && i % 6 == 3);
    return pond || pixel ? kHole : at(i, j);
  };
  const Land land({file});
  std::mt19937_64 random(test_seed(61));
  Renderer r(test_device(), land.db(),
             {.width = kWidth, .height = kHeight, .pixel_error = 3, .tessellation = Tessellation::mesh});
  LevelData level_data(land.db(), r.lattice());
  std::size_t torn = 0, large_torn = 0, large = 0, large_empty = 0, beside_finer = 0, holed = 0, in_holed = 0;
  for (int n = 0; n < 18; ++n) {
    r.reshape(kWidth, kHeight, n % 3 == 0 ? 1 : n % 3 == 1 ? 4 : 16);
    const Camera camera = random_camera(land.db(), random);
    r.draw(camera);
    const auto origin = half_cell_at(r.lattice(), {camera.eye.x, camera.eye.y});
    const auto mesh = r.mesh();
    std::map<std::uint32_t, std::vector<bool>> data;
    std::map<std::pair<std::uint32_t, int>, std::pair<std::size_t, bool>> blocks;  // triangles; holes
    for (std::size_t t = 0; t < mesh.size(); t += 3) {
      const MeshVertex *a = &mesh[t], *b = a + 1, *c = a + 2;
      const TileDraw& draw = r.drawn().draws[a->draw];
      const int level = std::countr_zero(draw.stride);
      const TileKey key{level, (draw.x + origin[0]) >> (7 + level), (draw.y + origin[1]) >> (7 + level)};
      auto& has = data[a->draw];
      if (has.empty()) has = level_data.of(key);
      const auto has_at = [&](int x, int y) { return has[std::size_t(y * TileLattice::kSamples + x)]; };
      const auto turn = [](const MeshVertex& p, const MeshVertex& q, int x, int y) {
        return (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
      };
      // A vertex on the border is the finest tile's that has it.
      bool whole = true, finer = false;
      for (const MeshVertex* v : {a, b, c}) {
        int finest = level;
        if (v->x % 128 == 0 || v->y % 128 == 0)
          for (const TileDraw& other : r.drawn().draws) {
            const std::int64_t x = draw.x + std::int64_t(v->x) * draw.stride - other.x;
            const std::int64_t y = draw.y + std::int64_t(v->y) * draw.stride - other.y;
            if (std::min(x, y) >= 0 && std::max(x, y) <= 128 * std::int64_t(other.stride))
              finest = std::min(finest, std::countr_zero(other.stride));
          }
        finer |= finest < level;
        whole = whole && (finest < level ? level_data.at(key, v->x, v->y, finest) : has_at(v->x, v->y));
      }
      std::size_t some = 0, none = 0;
      for (int y = std::min({a->y, b->y, c->y}); y <= std::max({a->y, b->y, c->y}); ++y)
        for (int x = std::min({a->x, b->x, c->x}); x <= std::max({a->x, b->x, c->x}); ++x)
          if (turn(*a, *b, x, y) >= 0 && turn(*b, *c, x, y) >= 0 && turn(*c, *a, x, y) >= 0)
            ++(has_at(x, y) ? some : none);
      const bool is_large = turn(*a, *b, c->x, c->y) > 4;
      const bool is_torn = whole ? none > 0 : some > 0;
      torn += is_torn, large_torn += is_torn && is_large, beside_finer += is_torn && finer;
      large += is_large && none == 0, large_empty += is_large && some == 0;
      auto& [triangles, holes] = blocks[{a->draw, BlockOf(a).block}];
      ++triangles, holes |= none > 0;
    }
    for (const auto& [block, counts] : blocks)
      if (counts.second) ++holed, in_holed += counts.first;
  }
  EXPECT_EQ(large_torn, 0u);
  EXPECT_GT(torn, 100u);
  EXPECT_GT(beside_finer, 0u);
  EXPECT_GT(large, 100u);
  EXPECT_GT(large_empty, 5u);
  EXPECT_LT(in_holed, 100 * holed) << "not all of a block's 128 triangles";
}

}  // namespace
}  // namespace patchwork
