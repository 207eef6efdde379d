// What the evaluator may do to save work without anyone seeing it: classification, choice of patches,
// residence.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "blend/vulkan/vulkan_blend_impl.h"
#include "tests/blend/vulkan_scene.h"

namespace patchwork {
namespace {

std::vector<GridFile> surveys_with_a_hole() {
  std::vector<GridFile> grids = surveys();
  grids[1].at = [whole = grids[1].at](int i, int j) {
    return i > 30 && i < 50 && j > 20 && j < 40 ? kHole : whole(i, j);
  };
  return grids;
}

// All planes of some tiles, one after another.
struct Planes {
  std::vector<float> height, bound, gradient;
  std::vector<std::int32_t> source;
  bool operator==(const Planes& o) const {
    const auto same = [](const std::vector<float>& a, const std::vector<float>& b) {
      return a.size() == b.size() &&
             (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
    };
    return same(height, o.height) && same(bound, o.bound) && same(gradient, o.gradient) && source == o.source;
  }
};

Planes planes_of(const VulkanBlend& blend, const RasterFrame& lattice, std::span<const Tile> tiles,
                 int side) {
  Planes all;
  blend.at_tiles(lattice, tiles, side, [&](const TileHeights& h) {
    all.height.insert(all.height.end(), h.height.begin(), h.height.end());
    all.bound.insert(all.bound.end(), h.bound.begin(), h.bound.end());
    all.gradient.insert(all.gradient.end(), h.gradient.begin(), h.gradient.end());
    all.source.insert(all.source.end(), h.source.begin(), h.source.end());
  });
  return all;
}

std::vector<Tile> tiles_over(int side, int tile) {
  std::vector<Tile> tiles;
  for (int r = 0; r < side; r += tile)
    for (int c = 0; c < side; c += tile) tiles.push_back({c, r, 1, tile, tile});
  return tiles;
}

class VulkanTiles : public VulkanTest {
 protected:
  static void SetUpTestSuite() { scene_ = std::make_unique<Land>(surveys_with_a_hole()); }
  static void TearDownTestSuite() { scene_.reset(); }
  static const Database& db() { return scene_->db(); }
  static std::unique_ptr<Land> scene_;
};
std::unique_ptr<Land> VulkanTiles::scene_;

TEST_F(VulkanTiles, ClassificationAndChoiceChangeNoBit) {
  const RasterFrame lattice = turned_raster(db().extent(), 130, 21);
  const std::vector<Tile> tiles = tiles_over(130, 65);
  for (const double error : {0.0, 5.0})
    for (const BlendOptions& options : all_blends()) {
      const Extraction x = extract(db(), {.error = error});
      const VulkanBlend all(test_device(), db(), x.patches, options, {.gradient = true});
      const VulkanBlend blocks(test_device(), db(), x.patches, options,
                               {.classify = false, .gradient = true});
      const VulkanBlend none(test_device(), db(), x.patches, options,
                             {.classify = false, .choose = false, .gradient = true});
      const Planes a = planes_of(all, lattice, tiles, 65);
      EXPECT_TRUE(a == planes_of(blocks, lattice, tiles, 65)) << name_of(options);
      EXPECT_TRUE(a == planes_of(none, lattice, tiles, 65)) << name_of(options);
      EXPECT_GT(all.shares().out, 0u);
      EXPECT_EQ(blocks.shares().out + blocks.shares().inside, 0u);
      if (options.composition == Composition::priority && error > 0) {
        EXPECT_GT(all.shares().inside, 0u);
      }
      const VulkanBlend other(test_device(), db(), extract(db(), {.error = 50}).patches, options,
                              {.gradient = true});
      EXPECT_FALSE(a == planes_of(other, lattice, tiles, 65)) << "negative control: another cut";
    }
}

TEST_F(VulkanTiles, AHaloIsWhatTheNeighbourHas) {
  const RasterFrame lattice = turned_raster(db().extent(), 96, 15);
  const Tile core[] = {{32, 32, 1, 32, 32}}, halo[] = {{31, 31, 1, 34, 34}}, next[] = {{64, 32, 1, 32, 32}};
  const VulkanBlend blend(test_device(), db(), extract(db(), {.error = 0}).patches, {.smoothness = 2});
  const Planes a = planes_of(blend, lattice, core, 34), b = planes_of(blend, lattice, halo, 34);
  const Planes c = planes_of(blend, lattice, next, 34);
  for (std::size_t r = 0; r < 32; ++r) {
    for (std::size_t k = 0; k < 32; ++k)
      ASSERT_NEAR(a.height[34 * r + k], b.height[34 * (r + 1) + k + 1], 1e-3);
    ASSERT_NEAR(c.height[34 * r], b.height[34 * (r + 1) + 33], 1e-3);
  }
}

// The analytic slope against central differences of the CPU's surface.
TEST_F(VulkanTiles, TheGradientIsTheSurfacesSlope) {
  const RasterFrame lattice = turned_raster(db().extent(), 64, 27);
  const Tile tile[] = {{0, 0, 1, 64, 64}};
  constexpr double kStep = 1e-4;  // metres
  for (const double error : {0.0, 5.0})
    for (const BlendOptions& options : all_blends()) {
      if (options.smoothness == 0) continue;  // jumps between cells
      const Extraction x = extract(db(), {.error = error});
      const Planes p = planes_of(VulkanBlend(test_device(), db(), x.patches, options, {.gradient = true}),
                                 lattice, tile, 64);
      Points points;
      for (int k = 0; k < 64 * 64; ++k) {
        const double c = k % 64, r = k / 64;
        const Point at{lattice.x0 + lattice.xc * c + lattice.xr * r,
                       lattice.y0 + lattice.yc * c + lattice.yr * r};
        points.add(at.x + kStep, at.y), points.add(at.x - kStep, at.y);
        points.add(at.x, at.y + kStep), points.add(at.x, at.y - kStep);
      }
      const Answers a = evaluate(db(), x.patches, points, options);
      std::size_t checked = 0;
      double steepest = 0, worst = 0;
      for (std::size_t k = 0; k < 64 * 64; ++k) {
        if (!(a.height[4 * k] + a.height[4 * k + 1] + a.height[4 * k + 2] + a.height[4 * k + 3] < INFINITY))
          continue;
        if (!(p.gradient[2 * k] < INFINITY)) continue;
        const double dx = (a.height[4 * k] - a.height[4 * k + 1]) / (2 * kStep);
        const double dy = (a.height[4 * k + 2] - a.height[4 * k + 3]) / (2 * kStep);
        steepest = std::max(steepest, std::hypot(dx, dy)), ++checked;
        const double o = std::hypot(p.gradient[2 * k] - dx, p.gradient[2 * k + 1] - dy);
        worst = std::max(worst, o);
      }
      EXPECT_GT(checked, 1000u);
      std::printf("%s: slopes up to %.2f, off by %.2g at most\n", name_of(options).c_str(), steepest, worst);
      EXPECT_LT(worst, 1e-5) << name_of(options);
      EXPECT_GT(steepest, 0.2) << "negative control: a slope of 0 would not do";
    }
}

TEST_F(VulkanTiles, APoolTooSmallForTheCutGivesTheSameBits) {
  const Extraction x = extract(db(), {.error = 0});
  const RasterFrame raster = turned_raster(db().extent(), 256, 12);
  for (const BlendOptions& options : {all_blends()[0], all_blends()[5]}) {
    const VulkanBlend large(test_device(), db(), x.patches, options, {.tile = 16});
    const VulkanBlend small(test_device(), db(), x.patches, options,
                            {.memory = PatchPool::kSlotBytes * 24, .tile = 16});
    ASSERT_GT(x.patches.size(), 24u);
    EXPECT_TRUE(at_pixels(large, raster, 256) == at_pixels(small, raster, 256)) << name_of(options);
    EXPECT_LE(small.pool().residents().size(), 24u);
    EXPECT_GT(small.pool().traffic().sent, x.patches.size());
    std::mt19937_64 random(test_seed(1));
    const Points points = random_points(db().extent(), 5000, random);
    EXPECT_TRUE(at_points(large, points) == at_points(small, points)) << name_of(options);
  }
}

TEST_F(VulkanTiles, ACutThatNoTileFitsIsAnError) {
  const Extraction x = extract(db(), {.error = 0});
  const VulkanBlend blend(test_device(), db(), x.patches, {},
                          {.memory = PatchPool::kSlotBytes * 4, .tile = 256});
  EXPECT_THROW(at_pixels(blend, turned_raster(db().extent(), 256, 12), 256), Error);
}

TEST_F(VulkanTiles, TheSameQuestionGetsTheSameBits) {
  const RasterFrame lattice = turned_raster(db().extent(), 260, 8);
  const std::vector<Tile> tiles = tiles_over(260, 65);
  std::vector<Tile> backwards(tiles.rbegin(), tiles.rend());
  for (const BlendOptions& options : all_blends()) {
    const VulkanBlend blend(test_device(), db(), extract(db(), {.error = 1}).patches, options);
    const Planes a = planes_of(blend, lattice, tiles, 65), b = planes_of(blend, lattice, tiles, 65);
    EXPECT_TRUE(a == b) << name_of(options);
    Planes c = planes_of(blend, lattice, backwards, 65);
    EXPECT_FALSE(a == c) << "negative control: the answers come in the order of the tiles";
    for (std::size_t t = 0; t < tiles.size() / 2; ++t)
      std::swap_ranges(c.height.begin() + long(t * 65 * 65), c.height.begin() + long((t + 1) * 65 * 65),
                       c.height.begin() + long((tiles.size() - 1 - t) * 65 * 65));
    EXPECT_EQ(std::memcmp(a.height.data(), c.height.data(), a.height.size() * sizeof(float)), 0);
  }
}

TEST_F(VulkanTiles, ResultsStayOnTheCardForWhoeverDrawsThem) {
  const RasterFrame lattice = turned_raster(db().extent(), 130, 8);
  const std::vector<Tile> tiles = tiles_over(130, 65);
  const VulkanBlend blend(test_device(), db(), extract(db(), {.error = 1}).patches, {});
  const Planes want = planes_of(blend, lattice, tiles, 65);
  const Device::Impl& device = test_device()->impl();
  std::vector<float> got;
  blend.impl().run(
      lattice, tiles, 65,
      [&](const TileBins& bins) {
        vk::Work work = blend.impl().tile_work(lattice, bins, 65, {});
        work.read_from = work.result_words;
        return work;
      },
      [&](const vk::Frame& frame, std::size_t, std::size_t count) {
        EXPECT_TRUE(frame.results().empty());
        const VkBufferCopy all{0, 0, count * 65 * 65 * 4};
        const vk::Buffer back(device, all.size, 0, vk::Where::readback);
        vk::Commands commands(device);
        vkCmdCopyBuffer(commands.begin(), frame.results_on_card().get(), back.get(), 1, &all);
        vk::barrier(commands.get());
        commands.submit();
        commands.wait();
        const auto* heights = reinterpret_cast<const float*>(back.mapped());
        got.insert(got.end(), heights, heights + count * 65 * 65);
      });
  ASSERT_EQ(got.size(), want.height.size());
  EXPECT_EQ(std::memcmp(got.data(), want.height.data(), got.size() * sizeof(float)), 0);
}

// 10 000 cuts one after another: what is resident is not sent, and stays until its room is needed.
TEST_F(VulkanTiles, ThePoolSendsWhatIsNotThereAndDropsTheLongestUnused) {
  std::mt19937_64 random(test_seed(2));
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::size_t room = 10;  // for the largest cut there is, and little more
  for (const PatchId id : extract(db(), {.error = 0}).patches) room += PatchPool::slots_of(db(), id);
  PatchPool pool(test_device(), db(), room);
  std::uint64_t bytes = 0, sent = 0, dropped = 0, everything = 0;
  const Extent e = db().extent();
  const auto slots_in = [](const std::map<PatchId, PatchPool::Resident>& residents) {
    std::set<std::uint32_t> slots;
    for (const auto& [id, r] : residents) {
      EXPECT_TRUE(slots.insert(r.slot).second) << "one slot of two patches";
      if (r.holes) {
        EXPECT_TRUE(slots.insert(*r.holes).second) << "one slot of two patches";
      }
    }
    return slots.size();
  };
  for (int n = 0; n < 10000; ++n) {
    const double x = uniform(e.xmin, e.xmax), y = uniform(e.ymin, e.ymax), half = uniform(50, 900);
    const UniformCut cut{.error = std::exp2(uniform(-3, 7)),
                         .region = Region::inside({x - half, y - half, x + half, y + half})};
    const Extraction now = extract(db(), cut);
    const std::map<PatchId, PatchPool::Resident> before = pool.residents();
    pool.hold(now.patches);
    std::size_t needed = 0;  // slots of what is new
    for (const PatchId id : now.patches) {
      const PatchPool::Resident& r = pool.at(id);
      everything += PatchPool::bytes_of(r);
      if (before.contains(id)) continue;
      ++sent, bytes += PatchPool::bytes_of(r), needed += r.holes ? 2 : 1;
    }
    std::uint64_t last_gone = 0, first_kept = UINT64_MAX;  // when they were held before
    std::size_t gone = 0;
    for (const auto& [id, r] : before) {
      const auto at = pool.residents().find(id);
      if (at == pool.residents().end())
        last_gone = std::max(last_gone, r.held), ++gone;
      else if (at->second.held == r.held)
        first_kept = std::min(first_kept, r.held);
    }
    dropped += gone;
    ASSERT_LE(last_gone, first_kept) << "the longest unused go first";
    if (gone > 0) {
      ASSERT_GT(slots_in(before) + needed, pool.slots()) << "what there is room for stays";
    }
    ASSERT_LE(slots_in(pool.residents()), pool.slots());
    ASSERT_EQ(pool.traffic(), (PatchPool::Traffic{sent, dropped, bytes})) << "cut " << n;
  }
  EXPECT_GT(everything, bytes + bytes / 100) << "negative control: sending every cut whole would be more";
  EXPECT_GT(dropped, 1000u);
}

// Slots are used again and again: what is in them is the patch's all the same.
TEST_F(VulkanTiles, AfterManyCutsTheSurfaceIsTheCutsOwn) {
  std::mt19937_64 random(test_seed(3));
  const RasterFrame raster = turned_raster(db().extent(), 96, 4);
  VulkanBlend blend(test_device(), db(), {}, {.smoothness = 1}, {.tile = 96});
  for (int n = 0; n < 40; ++n) {
    const double error = std::exp2(std::uniform_real_distribution<double>(-3, 7)(random));
    const Extraction x = extract(db(), {.error = error});
    blend.change(x.patches);
    expect_parity(at_pixels(Blend(db(), x.patches, {.smoothness = 1}), raster, 96),
                  at_pixels(blend, raster, 96), "cut " + std::to_string(n));
  }
}

}  // namespace
}  // namespace patchwork
