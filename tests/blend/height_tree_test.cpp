// MinMaxPyramid (hard cases): no height of a patch, and none of a blend, lies above the largest heights of
// its block and the boxes over it; the highest sample does not hold what a bicubic makes of it.
#include "blend/height_tree.h"

#include <gtest/gtest.h>

#include "blend/kernels.h"
#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

constexpr int kBlocks = HeightTree::kBlocks, kCells = HeightTree::kCells, kSide = PatchSurface::kSide;

std::vector<Blend::Placed> placed_of(const Database& db, std::span<const PatchId> ids, int smoothness) {
  std::vector<Blend::Placed> placed;
  for (const PatchId id : ids) placed.push_back(place(db, id, smoothness));
  return placed;
}

// Along one axis: the block that speaks for a window coordinate.
int block_of(double u) { return std::clamp(int((u - 1) / kCells), 0, kBlocks - 1); }

// The naive form: the highest sample of a block's cells.
double highest_sample(const Blend::Placed& p, const PatchSurface& s, int i, int j) {
  double most = -INFINITY;
  for (int b = 1 + j * kCells; b <= std::min(1 + (j + 1) * kCells, kSide - 2); ++b)
    for (int a = 1 + i * kCells; a <= std::min(1 + (i + 1) * kCells, kSide - 2); ++a)
      most = std::max(most, p.quantum * (p.origin + double(s.codes[std::size_t(b * kSide + a)])) + p.base);
  return most;
}

double rough(int i, int j) { return 300 + 40 * std::sin(12.9898 * i * i + 78.233 * j * j + 3.7 * i * j); }

struct Seen {
  std::size_t values = 0, above_samples = 0;
};

// Every patch there is, at random points; two of three halfway between two samples of a line, where an
// interpolant rises most above them.
void expect_blocks_hold(const Database& db, int smoothness, std::mt19937_64& random, Seen& seen) {
  constexpr std::size_t kPoints = 200;
  std::vector<PatchId> ids;
  each_patch(db,
             [&](const Grid& g, std::size_t k, const GridShape::Block&) { ids.push_back(g.patch_id(k)); });
  const std::vector<Blend::Placed> placed = placed_of(db, ids, smoothness);
  const HeightTree tree(db, placed, smoothness);
  std::vector<double> u(kPoints), v(kPoints), value(kPoints);
  for (std::size_t k = 0; k < placed.size(); ++k) {
    const Blend::Placed& p = placed[k];
    const LatticeRect& d = p.domain;
    std::uniform_real_distribution<double> i(d.i0, d.i1), j(d.j0, d.j1);
    const auto surface = db.surface(p.id);
    for (std::size_t n = 0; n < kPoints; ++n) {
      u[n] = i(random), v[n] = j(random);
      if (n % 3 == 1) u[n] = std::floor(u[n]) + 0.5, v[n] = std::floor(v[n]);
      if (n % 3 == 2) u[n] = std::floor(u[n]), v[n] = std::floor(v[n]) + 0.5;
      u[n] = std::clamp(u[n], d.i0, d.i1), v[n] = std::clamp(v[n], d.j0, d.j1);
    }
    kernels::interpolate(smoothness, surface->codes.data(), u.data(), v.data(), int(kPoints), value.data());
    for (std::size_t n = 0; n < kPoints; ++n) {
      const int a = block_of(u[n]), b = block_of(v[n]);
      const double h = p.quantum * (p.origin + value[n]) + p.base;
      const double highest = double(tree.highest(k, a, b)), sample = highest_sample(p, *surface, a, b);
      ASSERT_LE(h, highest) << "k=" << smoothness << " level " << p.id.level() << " at " << u[n] << " "
                            << v[n];
      if (smoothness == 0) {
        ASSERT_LE(highest, sample + 1e-3) << "no higher than it must be";
      }
      ++seen.values, seen.above_samples += h > sample + 1e-3;
    }
  }
}

class MinMaxPyramid : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::vector<GridFile> grids = surveys();
    grids.push_back({.width = 100,
                     .height = 80,
                     .geotransform = rotated(300, 1000, 25, 6, 6),
                     .accuracy = 0.01,
                     .at = rough});
    land_ = std::make_unique<Land>(grids);
  }
  static void TearDownTestSuite() { land_.reset(); }
  static const Database& db() { return land_->db(); }
  static std::unique_ptr<Land> land_;
};
std::unique_ptr<Land> MinMaxPyramid::land_;

TEST_F(MinMaxPyramid, EveryBlockHoldsWhatItsPatchTakesBetweenSamples) {
  std::mt19937_64 random(test_seed(1));
  std::size_t values = 0, above = 0;
  for (const int k : {0, 1, 2}) {
    Seen seen;
    expect_blocks_hold(db(), k, random, seen);
    if (HasFatalFailure()) return;
    if (k == 0) {
      EXPECT_EQ(seen.above_samples, 0u) << "a bilinear surface lies between its samples";
    } else {
      EXPECT_GT(seen.above_samples, 5u) << "negative control: k=" << k;
    }
    values += seen.values, above += seen.above_samples;
  }
  report_law("MinMaxPyramid", "blocks hold what patches take between their samples, k = 0, 1, 2", values);
  report_control("MinMaxPyramid", "above every sample of their block", values, double(above), 0, "heights");
}

TEST_F(MinMaxPyramid, NoBlendedHeightLiesAboveEveryBlockAtItsPlace) {
  std::mt19937_64 random(test_seed(2));
  Points points = random_points(db().extent(), 300, random);
  // Halfway between samples of the rough grid, inside its kernels.
  const Grid& grid = db().grids().back();
  std::uniform_int_distribution<int> i(10, 88), j(10, 68);
  for (int n = 0; n < 600; ++n) points.add(grid.info.frame.to_domain(i(random) + 0.5, j(random)));
  std::size_t tries = 0, above_samples = 0;
  for (const double error : {0.0, 4.0})
    for (const BlendOptions& options : all_blends()) {
      const Extraction x = extract(db(), {.error = error});
      const std::vector<Blend::Placed> placed = placed_of(db(), x.patches, options.smoothness);
      const HeightTree tree(db(), placed, options.smoothness);
      const Answers a = evaluate(db(), x.patches, points, options);
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (a.source[k] == 0) continue;
        const Point p{points.x[k], points.y[k]};
        const double h = a.height[k];
        double highest = -INFINITY, sample = -INFINITY;
        tree.visit([&](const Extent& e, double most) { return e.contains(p) && most >= h; },
                   [&](std::size_t n) {
                     const Blend::Placed& q = placed[n];
                     const double dx = p.x - q.x0, dy = p.y - q.y0;
                     const double u = (q.ua * dx + q.ub * dy) - q.first_i;
                     const double v = (q.va * dx + q.vb * dy) - q.first_j;
                     if (u < q.domain.i0 || u > q.domain.i1 || v < q.domain.j0 || v > q.domain.j1) return;
                     const int bi = block_of(u), bj = block_of(v);
                     highest = std::max(highest, double(tree.highest(n, bi, bj)));
                     sample = std::max(sample, highest_sample(q, *db().surface(q.id), bi, bj));
                   });
        ASSERT_LE(h, highest) << name_of(options) << " error " << error << " at " << p.x << " " << p.y;
        ++tries, above_samples += h > sample + 1e-3;
      }
    }
  report_law("MinMaxPyramid", "the tree finds a block as high as every blended height", tries);
  report_control("MinMaxPyramid", "blended, above every sample of the blocks there", tries,
                 double(above_samples), 0, "heights");
}

// The raw samples' scale is negative, so the least of them is the highest place.
TEST(MinMaxPyramidOfDepths, HoldsTheHighestPlacesToo) {
  GridFolder folder;
  Database db = folder.database();
  const std::string file = folder.write(
      {.width = 61, .height = 40, .geotransform = {0, 10, 0, 400, 0, -10}, .at = rough}, "depths");
  {
    const GDALDatasetUniquePtr raw(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    ASSERT_TRUE(raw && raw->GetRasterBand(1)->SetScale(-1) == CE_None);
  }
  db.import(RasterSource::open(file, {.accuracy = 0.1}, ""), {.name = "depths"});
  ASSERT_LT(db.grids()[0].info.quantum, 0);
  std::mt19937_64 random(test_seed(3));
  for (const int k : {0, 1, 2}) {
    Seen seen;
    expect_blocks_hold(db, k, random, seen);
    if (HasFatalFailure()) return;
  }
}

// Walls two samples wide and 100 m high, and a tower where two cross. Halfway between its two samples an
// interpolant of k = 1, 2 weighs -1/16, 9/16, 9/16, -1/16: 112.5 m over a wall, (9/8)^2 of 100 m over the
// tower. Second differences are 100 m: a block allows an eighth of them, those across rows once more by a
// quarter.
TEST(MinMaxPyramidOfATower, IsAsHighAsTheFormulasSay) {
  struct Shape {
    bool along_i, along_j;
    double taken, allowed;
  };
  for (const Shape& s : {Shape{true, false, 112.5, 112.5}, Shape{false, true, 112.5, 115.625},
                         Shape{true, true, 126.5625, 128.125}}) {
    GridFile file{.width = 60, .height = 60, .geotransform = {0, 8, 0, 480, 0, -8}};
    file.at = [s](int i, int j) {
      const bool in_i = i == 24 || i == 25, in_j = j == 24 || j == 25;
      return (in_i || !s.along_i) && (in_j || !s.along_j) ? 100.0 : 0.0;
    };
    const Land land({file});
    const Grid& g = land.db().grids()[0];
    const PatchId id = PatchId::make(g.info.id, 0, 0, 0);  // window = lattice + 3
    Points middle;
    middle.add(g.info.frame.to_domain(24.5, 24.5));
    for (const int k : {0, 1, 2}) {
      const std::vector<Blend::Placed> placed = placed_of(land.db(), std::span(&id, 1), k);
      const HeightTree tree(land.db(), placed, k);
      const double taken = evaluate(land.db(), std::span(&id, 1), middle, {.smoothness = k}).height[0];
      EXPECT_NEAR(taken, k == 0 ? 100 : s.taken, 1e-9);
      const double highest = double(tree.highest(0, block_of(27.5), block_of(27.5)));
      EXPECT_GE(highest, taken);
      EXPECT_NEAR(highest, k == 0 ? 100 : s.allowed, 1e-3) << "k=" << k;
      EXPECT_NEAR(double(tree.highest(0, 0, 0)), 0, 1e-3) << "nothing where the ground is flat";
    }
  }
}

}  // namespace
}  // namespace patchwork
