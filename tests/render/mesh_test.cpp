// The mesh that compute shaders make of the terrain: no gap, no vertex inside an edge, what hardware shows.
#include <gtest/gtest.h>

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
  std::map<std::pair<std::uint32_t, int>, std::int64_t> area;  // half cells^2, twice; by draw and block
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
  for (std::size_t t = 0; t < mesh.size(); t += 3) {
    const MeshVertex *a = &mesh[t], *b = a + 1, *c = a + 2;
    const int x = (a->x + b->x + c->x) / 48, y = (a->y + b->y + c->y) / 48;
    const std::int64_t twice =
        std::int64_t(b->x - a->x) * (c->y - a->y) - std::int64_t(c->x - a->x) * (b->y - a->y);
    EXPECT_GT(twice, 0);
    s.area[{a->draw, 8 * y + x}] += twice;
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

}  // namespace
}  // namespace patchwork
