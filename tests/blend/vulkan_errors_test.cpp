// Block errors: what a tile's simplified triangles are off the blend, against a reference in double.
#include <gtest/gtest.h>

#include "tests/blend/vulkan_scene.h"

namespace patchwork {
namespace {

constexpr int kSide = 33, kCells = 8, kBlocks = (kSide - 1) / kCells;

// A tile of the lattice at `fine` points a cell, by the CPU.
struct Dense {
  Dense(const Database& db, std::span<const PatchId> patches, const BlendOptions& options,
        const RasterFrame& f, const Tile& t, int fine_)
      : fine(fine_), side(fine_ * (kSide - 1) + 1), answers(std::size_t(side) * std::size_t(side)) {
    const double step = double(t.stride) / fine;
    const RasterFrame dense{f.x0 + f.xc * t.c0 + f.xr * t.r0, f.xc * step, f.xr * step,
                            f.y0 + f.yc * t.c0 + f.yr * t.r0, f.yc * step, f.yr * step};
    answers = at_pixels(Blend(db, patches, options), dense, side);
  }
  double height(int c, int r) const {
    return answers.height[std::size_t(r) * std::size_t(side) + std::size_t(c)];
  }
  double bound() const { return *std::max_element(answers.bound.begin(), answers.bound.end()); }

  // Largest distance from either triangulation of a block with every 2^d-th vertex.
  double off(int block, int d) const {
    const int across = kCells * fine, size = fine << d, c0 = block % kBlocks * across,
              r0 = block / kBlocks * across;
    double worst = 0;
    for (int r = 0; r <= across; ++r)
      for (int c = 0; c <= across; ++c) {
        const int i = std::min(c / size * size, across - size), j = std::min(r / size * size, across - size);
        const double s = double(c - i) / size, t = double(r - j) / size, h = height(c0 + c, r0 + r);
        const double a = height(c0 + i, r0 + j), b = height(c0 + i + size, r0 + j);
        const double e = height(c0 + i, r0 + j + size), f = height(c0 + i + size, r0 + j + size);
        const double falling = s >= t ? a + s * (b - a) + t * (f - b) : a + t * (e - a) + s * (f - e);
        const double rising =
            s + t <= 1 ? a + s * (b - a) + t * (e - a) : f + (1 - s) * (e - f) + (1 - t) * (b - f);
        worst = std::max({worst, std::abs(h - falling), std::abs(h - rising)});
      }
    return worst;
  }
  // Half of the largest second differences along either axis.
  double between(int block) const {
    const int n = kCells * fine, c0 = block % kBlocks * n, r0 = block / kBlocks * n;
    double across = 0, down = 0;
    for (int k = 0; k <= n; ++k)
      for (int i = 1; i < n; ++i) {
        across = std::max(across, std::abs(height(c0 + i - 1, r0 + k) - 2 * height(c0 + i, r0 + k) +
                                           height(c0 + i + 1, r0 + k)));
        down = std::max(down, std::abs(height(c0 + k, r0 + i - 1) - 2 * height(c0 + k, r0 + i) +
                                       height(c0 + k, r0 + i + 1)));
      }
    return 0.5 * (across + down);
  }

  int fine, side;
  Answers answers;
};

class BlockErrors : public VulkanTest {
 protected:
  static void SetUpTestSuite() { scene_ = std::make_unique<Land>(surveys()); }
  static void TearDownTestSuite() { scene_.reset(); }
  static const Database& db() { return scene_->db(); }
  static std::vector<float> of(const VulkanBlend& blend, const RasterFrame& f, std::span<const Tile> tiles,
                               int fine) {
    std::vector<float> all;
    blend.block_errors(f, tiles, kSide, fine, [&](const TileErrors& e) {
      EXPECT_EQ(e.across, kBlocks);
      EXPECT_EQ(e.first * kBlocks * kBlocks * 3, all.size());
      all.insert(all.end(), e.lambda.begin(), e.lambda.end());
    });
    return all;
  }
  static std::unique_ptr<Land> scene_;
};
std::unique_ptr<Land> BlockErrors::scene_;

// A lattice of 6 m, turned, whose tiles lie inside all data.
const RasterFrame kLattice{500, 5.9, 1.1, 600, 1.1, -5.9};
const Tile kTiles[] = {{0, 0, 1, kSide, kSide}, {32, 0, 1, kSide, kSide}, {16, -40, 2, kSide, kSide}};

TEST_F(BlockErrors, AreTheReferencesInDouble) {
  for (const double error : {0.0, 5.0})
    for (const BlendOptions& options : all_blends()) {
      const Extraction x = extract(db(), {.error = error});
      const VulkanBlend blend(test_device(), db(), x.patches, options);
      const std::vector<float> lambda = of(blend, kLattice, kTiles, 4);
      ASSERT_EQ(lambda.size(), std::size(kTiles) * kBlocks * kBlocks * 3);
      for (std::size_t t = 0; t < std::size(kTiles); ++t) {
        const Dense dense(db(), x.patches, options, kLattice, kTiles[t], 4);
        for (int b = 0; b < kBlocks * kBlocks; ++b) {
          double most = 0;
          for (int d = 1; d <= 3; ++d) {
            most = std::max(most, dense.off(b, d));
            const double got = lambda[(t * kBlocks * kBlocks + std::size_t(b)) * 3 + std::size_t(d) - 1];
            ASSERT_NEAR(got, most + dense.between(b) + dense.bound(), 4e-3)
                << name_of(options) << " tile " << t << " block " << b << " d " << d;
          }
        }
      }
    }
}

TEST_F(BlockErrors, HoldBetweenTheSamplesToo) {
  std::size_t coarser_would_not_do = 0;
  for (const BlendOptions& options : all_blends()) {
    const Extraction x = extract(db(), {.error = 0});
    const VulkanBlend blend(test_device(), db(), x.patches, options);
    const std::vector<float> lambda = of(blend, kLattice, kTiles, 4);
    for (std::size_t t = 0; t < std::size(kTiles); ++t) {
      const Dense truth(db(), x.patches, options, kLattice, kTiles[t], 24);
      const Dense vertices(db(), x.patches, options, kLattice, kTiles[t], 1);
      for (int b = 0; b < kBlocks * kBlocks; ++b)
        for (int d = 1; d <= 3; ++d) {
          const float* l = &lambda[(t * kBlocks * kBlocks + std::size_t(b)) * 3];
          ASSERT_GE(l[d - 1] - truth.bound() + 4e-3, truth.off(b, d)) << name_of(options) << " d " << d;
          ASSERT_GE(l[d - 1], d > 1 ? l[d - 2] : 0) << "larger steps have no smaller errors";
          coarser_would_not_do += vertices.off(b, d) + 0.05 < truth.off(b, d);
        }
    }
  }
  EXPECT_GT(coarser_would_not_do, 0u) << "negative control: the tile's vertices alone see too little";
}

TEST_F(BlockErrors, AreInfiniteWhereSomethingHasNoData) {
  const Extraction x = extract(db(), {.error = 5});
  const VulkanBlend blend(test_device(), db(), x.patches, {});
  const Extent e = db().extent();
  const RasterFrame over_the_rim{e.xmin - 100, 6, 0, 600, 0, -6};
  const Tile tile[] = {{0, 0, 1, kSide, kSide}};
  const std::vector<float> lambda = of(blend, over_the_rim, tile, 2);
  EXPECT_EQ(lambda[0], INFINITY);
  EXPECT_LT(lambda.back(), 1000);
}

}  // namespace
}  // namespace patchwork
