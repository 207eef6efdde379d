// Extraction: the tree gives what scanning all patches gives, in the order in which they speak.
#include "query/extract.h"

#include <gtest/gtest.h>

#include <random>

#include "db/invariant.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

constexpr double kErrors[] = {0, 0.1, 0.4, 1, 2.5, 7, 20, 60, 1e9};

class Extract : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<GridFolder>();
    db_ = std::make_unique<Database>(folder_->database());
    const auto terrain = [](double x, double y) {
      return 40 * std::sin(x / 300) * std::cos(y / 200) + 3 * std::sin(x / 31 + y / 40);
    };
    GridFile base{.width = 120, .height = 100, .geotransform = {0, 20, 0, 2000, 0, -20}, .accuracy = 2};
    GridFile fine{.width = 140, .height = 90, .geotransform = rotated(500, 1200, 24, 6, 6), .accuracy = 0.3};
    GridFile finest{
        .width = 100, .height = 80, .geotransform = rotated(900, 1400, -40, 3, 4), .accuracy = 0.1};
    fine = of_terrain(fine, terrain);
    fine.at = [at = fine.at](int i, int j) { return i > 60 && i < 90 && j < 40 ? kHole : at(i, j); };
    folder_->add(*db_, of_terrain(base, terrain), "base");
    folder_->add(*db_, fine, "fine");
    folder_->add(*db_, of_terrain(finest, terrain), "finest");
  }
  static void TearDownTestSuite() { db_.reset(), folder_.reset(); }

  // The definition: model, sections 3 and 5.
  static bool wanted(const Grid& g, std::size_t index, const UniformCut& cut) {
    const PatchRecord& p = g.patches[index];
    if (!p.exists() || p.top <= p.bottom) return false;
    const bool reaches = p.bottom <= cut.error || (p.best() && !cut.strict);
    return reaches && cut.error < p.top && cut.region.meets(g, g.info.shape.block(index));
  }
  static std::vector<PatchId> scanned(const UniformCut& cut) {
    std::vector<PatchId> ids;
    for (const Grid& g : db_->grids())
      for (std::size_t k = 0; k < g.patches.size(); ++k)
        if (wanted(g, k, cut)) ids.push_back(g.patch_id(k));
    return ids;
  }
  static void expect_scanned(const UniformCut& cut) {
    std::vector<PatchId> found = extract(*db_, cut).patches;
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, scanned(cut)) << "error " << cut.error;
  }
  static const Grid& grid(PatchId id) { return db_->grid(id.grid()); }
  static std::size_t index(PatchId id) { return grid(id).info.shape.index(id.level(), id.bx(), id.by()); }

  static std::unique_ptr<GridFolder> folder_;
  static std::unique_ptr<Database> db_;
};
std::unique_ptr<GridFolder> Extract::folder_;
std::unique_ptr<Database> Extract::db_;

TEST_F(Extract, AgreesWithScanningAllPatches) {
  for (const double error : kErrors) {
    expect_scanned({.error = error});
    EXPECT_FALSE(extract(*db_, {.error = error}).patches.empty());
  }
  // Exactly at every bottom and every top, where < and <= differ.
  for (const Grid& g : db_->grids())
    each_patch(g, [&](std::size_t k, auto) {
      const PatchRecord& p = g.patches[k];
      expect_scanned({.error = p.bottom});
      expect_scanned({.error = p.bottom, .strict = true});
      if (std::isfinite(p.top)) expect_scanned({.error = p.top});
    });
}

TEST_F(Extract, AgreesWithScanningInExtentsAndPolygons) {
  std::mt19937_64 random(test_seed(1));
  std::uniform_real_distribution<double> at(-200, 2500);
  for (int n = 0; n < 100; ++n) {
    double x0 = at(random), x1 = at(random), y0 = at(random), y1 = at(random);
    const Region polygon = Region::inside(std::vector<Point>{{x0, y0}, {x1, y0}, {x1, y1}});
    if (x0 > x1) std::swap(x0, x1);
    if (y0 > y1) std::swap(y0, y1);
    for (const double error : kErrors) {
      expect_scanned({.error = error, .region = Region::inside(Extent{x0, y0, x1, y1})});
      expect_scanned({.error = error, .region = polygon});
    }
  }
}

TEST_F(Extract, SpeaksByBottomThenTheGreaterFirst) {
  for (const double error : kErrors) {
    const std::vector<PatchId> ids = extract(*db_, {.error = error}).patches;
    for (std::size_t k = 1; k < ids.size(); ++k) {
      const double before = db_->patch(ids[k - 1]).bottom, after = db_->patch(ids[k]).bottom;
      ASSERT_LE(before, after);
      CoverageCounts counts;
      if (before == after) {
        ASSERT_TRUE(less(grid(ids[k]), index(ids[k]), grid(ids[k - 1]), index(ids[k - 1]), counts));
      }
    }
  }
}

TEST_F(Extract, StrictLeavesOutWhatIsWorseAndNothingElse) {
  for (const double error : kErrors) {
    const Extraction all = extract(*db_, {.error = error}),
                     strict = extract(*db_, {.error = error, .strict = true});
    std::vector<PatchId> within;
    for (const PatchId id : all.patches)
      if (db_->patch(id).bottom <= error) within.push_back(id);
    EXPECT_EQ(strict.patches, within);
    EXPECT_LE(strict.bound_max, error);
  }
  EXPECT_TRUE(extract(*db_, {.error = 0, .strict = true}).patches.empty());
  EXPECT_FALSE(extract(*db_, {.error = 0}).patches.empty()) << "negative control: the best there is";
}

TEST_F(Extract, SaysWhatItCostAndWhichBoundsItGives) {
  for (const double error : kErrors) {
    const Extraction x = extract(*db_, {.error = error});
    double most = 0, inside = 0, least = INFINITY;
    for (const PatchId id : x.patches) {
      const GridInfo& g = grid(id).info;
      const LatticeRect d = g.shape.domain(id.level(), id.bx(), id.by());
      const bool rim = d.i0 < 0 || d.j0 < 0 || d.i1 > g.shape.width() - 1 || d.j1 > g.shape.height() - 1;
      most = std::max(most, db_->patch(id).bottom + (rim ? g.rim_error : 0)),
      inside = std::max(inside, db_->patch(id).bottom), least = std::min(least, db_->patch(id).bottom);
    }
    EXPECT_EQ(x.bound_max, most);
    EXPECT_EQ(x.bound_inside, inside);
    EXPECT_EQ(x.error_available, least);
    EXPECT_EQ(x.cost.patches, x.patches.size());
    EXPECT_EQ(x.cost.bytes, x.patches.size() * sizeof(PatchSurface::codes));
    EXPECT_GE(x.cost.boxes, x.patches.size());
    EXPECT_GE(x.cost.nodes, 1u);
  }
  const Extraction far = extract(*db_, {.error = 1, .region = Region::inside(Extent{1e6, 1e6, 2e6, 2e6})});
  EXPECT_TRUE(far.patches.empty());
  EXPECT_EQ(far.bound_max, 0);
  EXPECT_EQ(far.bound_inside, 0);
}

TEST_F(Extract, CoarserCutsNeedFewerPatches) {
  EXPECT_LT(extract(*db_, {.error = 60}).patches.size(), extract(*db_, {.error = 0}).patches.size());
}

TEST_F(Extract, AnErrorThatIsNoErrorIsRefused) {
  for (const double error : {-1.0, -1e-300, double(NAN), -double(INFINITY), double(INFINITY)})
    EXPECT_NE(refusal_of([&] { extract(*db_, {.error = error}); }), "");
  EXPECT_EQ(refusal_of([&] { extract(*db_, {.error = 1e300}); }), "") << "negative control";
}

}  // namespace
}  // namespace patchwork
