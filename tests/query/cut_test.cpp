// Cuts: what they range over, which patches they take, how answers differ and keep to a budget.
#include "query/cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "query/extract.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/query/random_cuts.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

class CutTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new GridFolder;
    db_ = new Database(folder_->database());
    folder_->add(
        *db_,
        of_terrain(
            {.width = 300, .height = 280, .geotransform = rotated(-1500, 1400, 0, 10, 10), .accuracy = 1},
            rough_terrain),
        "base");
    folder_->add(*db_,
                 of_terrain({.width = 250, .height = 200, .geotransform = rotated(-300, 200, 25, 3, 3)},
                            rough_terrain),
                 "survey");
  }
  static void TearDownTestSuite() { delete db_, delete folder_; }
  static std::vector<PatchId> scanned(const CutSurface& cut, bool strict) {
    std::vector<PatchId> ids;
    for (const Grid& g : db_->grids())
      each_patch(g, [&](std::size_t k, GridShape::Block b) {
        const PatchRecord& p = g.patches[k];
        const ToleranceRange r = cut.over(g.info.frame, g.info.shape.domain(b.level, b.bx, b.by));
        const bool low_enough = p.bottom <= r.high || (p.best() && !strict);
        if (!p.dormant() && low_enough && r.low < p.top && cut.meets(g, b)) ids.push_back(g.patch_id(k));
      });
    std::sort(ids.begin(), ids.end());
    return ids;
  }
  static std::vector<PatchId> sorted(std::vector<PatchId> ids) {
    std::sort(ids.begin(), ids.end());
    return ids;
  }
  static GridFolder* folder_;
  static Database* db_;
};
GridFolder* CutTest::folder_ = nullptr;
Database* CutTest::db_ = nullptr;

TEST_F(CutTest, ExtractionsAgreeWithScanningEveryPatch) {
  Random random(test_seed(2));
  std::size_t found = 0;
  for (int n = 0; n < test_trials(300); ++n) {
    const auto cut = any_cut(random, 2000, n % 4);
    const bool strict = n % 2;
    const std::vector<PatchId> ids = sorted(extract(*db_, *cut, strict).patches);
    ASSERT_EQ(ids, scanned(*cut, strict)) << n;
    found += ids.size();
  }
  EXPECT_GT(found, 1000u);
}

TEST_F(CutTest, RangesHoldEveryToleranceInside) {
  Random random(test_seed(3));
  int narrow = 0;
  for (int n = 0; n < 2000; ++n) {
    const auto cut = any_cut(random, 2000, 1 + n % 3);
    const Frame frame = sheared(random, n % 8 == 0 ? Frame::kMostShear : 0);
    const LatticeRect rect{-3, 2, random.uniform(0, 40), random.uniform(3, 40)};
    const ToleranceRange r = cut->over(frame, rect);
    double low = INFINITY, high = 0;
    for (int k = 0; k < 60; ++k) {
      const double a = k < 4 ? k % 2 : random.uniform(0, 1), b = k < 4 ? k / 2 : random.uniform(0, 1);
      const double e =
          cut->at(frame.to_domain(rect.i0 + a * (rect.i1 - rect.i0), rect.j0 + b * (rect.j1 - rect.j0)));
      low = std::min(low, e), high = std::max(high, e);
    }
    EXPECT_LE(r.low, low * (1 + 1e-9) + 1e-9);
    EXPECT_GE(r.high, high * (1 - 1e-9));
    narrow += r.high < high * (1 + 1e-9);
  }
  EXPECT_GT(narrow, 500) << "and a view's is no wider than it must be: its largest is at a corner";
}

// Else pages would be passed by that hold patches which are meant, and answers would depend on the tree.
TEST_F(CutTest, RangesOfARectangleHoldThoseOfRectanglesInIt) {
  Random random(test_seed(6));
  const Frame frame = Frame::from_trusted({0, 1, 0, 0, 0, 1});
  for (int n = 0; n < 6000; ++n) {
    const auto cut = any_cut(random, 2000, 1 + n % 3);
    const double x = random.uniform(-2000, 2000), y = random.uniform(-2000, 2000);
    const LatticeRect outer{x, y, x + random.uniform(1, 1000), y + random.uniform(1, 1000)};
    const auto part = [&](double a, double b) {
      const double p = random.uniform(a, b), q = random.uniform(a, b);
      return std::pair(std::min(p, q), std::max(p, q));
    };
    const auto [i0, i1] = part(outer.i0, outer.i1);
    const auto [j0, j1] = part(outer.j0, outer.j1);
    const ToleranceRange all = cut->over(frame, outer), some = cut->over(frame, {i0, j0, i1, j1});
    ASSERT_LE(all.low, some.low * (1 + 1e-7) + 1e-9) << n;
    ASSERT_GE(all.high, some.high * (1 - 1e-7) - 1e-9) << n;
  }
}

TEST_F(CutTest, AConeInSpaceAllowsMoreThanThePlaneAndNoMoreThanIsSeenUnderItsPixels) {
  Random random(test_seed(14));
  int more = 0, too_much = 0;
  for (int n = 0; n < 2000; ++n) {
    ViewCut v = random.view(2000);
    v.in_space = false;
    const auto plane = make_surface(v);
    v.in_space = true;
    const auto space = make_surface(v);
    const Point3 p{random.uniform(-2000, 2000), random.uniform(-2000, 2000),
                   random.uniform(v.lowest, v.highest)};
    const double gamma = v.height / (2 * std::tan(v.fov_degrees * std::numbers::pi / 360));
    const double away = std::hypot(p.x - v.eye.x, p.y - v.eye.y, p.z - v.eye.z);
    EXPECT_LE(space->at({p.x, p.y}), v.pixel_error * away / gamma * (1 + 1e-12));
    EXPECT_GE(space->at({p.x, p.y}), plane->at({p.x, p.y}));
    more += space->at({p.x, p.y}) > plane->at({p.x, p.y}) * 1.1;
    v.highest = v.lowest;  // heights that the terrain does not keep to
    too_much += make_surface(v)->at({p.x, p.y}) > v.pixel_error * away / gamma;
  }
  EXPECT_GT(more, 500);
  EXPECT_GT(too_much, 100) << "negative control";
}

TEST_F(CutTest, AFootprintHoldsEveryPointThatIsSeen) {
  Random random(test_seed(4));
  int seen = 0, outside_smaller = 0;
  for (int n = 0; n < 300; ++n) {
    const ViewCut v = random.view(2000);
    const std::vector<Point> corners = footprint(v);
    const auto inside = [&](Point p, double slack) {
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
        const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
        if (side < slack * std::hypot(b.x - a.x, b.y - a.y)) return false;
      }
      return corners.size() >= 3;
    };
    // Rays through random pixels, to random depths and heights of the terrain.
    const double fx = v.look.x - v.eye.x, fy = v.look.y - v.eye.y, fz = v.look.z - v.eye.z,
                 f = std::hypot(fx, fy, fz);
    const bool steep = std::hypot(fx, fy) < 1e-9 * f;
    const double rx = steep ? 1 : fy / std::hypot(fx, fy), ry = steep ? 0 : -fx / std::hypot(fx, fy);
    const double ux = ry * fz / f, uy = -rx * fz / f, uz = (rx * fy - ry * fx) / f;
    const double ty = std::tan(v.fov_degrees * std::numbers::pi / 360), tx = ty * v.width / v.height;
    for (int k = 0; k < 200; ++k) {
      const double a = random.uniform(-1, 1) * tx, b = random.uniform(-1, 1) * ty,
                   t = random.uniform(0, v.far);
      const double z = v.eye.z + t * (fz / f + b * uz);
      if (z < v.lowest || z > v.highest) continue;
      ++seen;
      const Point p{v.eye.x + t * (fx / f + a * rx + b * ux), v.eye.y + t * (fy / f + a * ry + b * uy)};
      EXPECT_TRUE(inside(p, -1e-6)) << n;
      outside_smaller += !inside(p, 60);
    }
  }
  EXPECT_GT(seen, 2000);
  EXPECT_GT(outside_smaller, 100) << "negative control: a footprint 60 m smaller misses some";
}

// Long lines are asked for their near sides alone.
TEST_F(CutTest, ACorridorOfManyPointsIsTheClosestOfItsSides) {
  Random random(test_seed(22));
  for (int n = 0; n < 20; ++n) {
    CorridorCut all = random.corridor(2000);
    all.line = {{random.uniform(-2000, 2000), random.uniform(-2000, 2000)}};
    for (int k = 0; k < 300; ++k)
      all.line.push_back(
          {all.line.back().x + random.uniform(-60, 60), all.line.back().y + random.uniform(-60, 60)});
    if (n % 5 == 4) std::swap(all.error, all.outside);  // a strip that needs less
    const auto cut = make_surface(all);
    std::vector<std::unique_ptr<CutSurface>> sides;
    for (std::size_t k = 0; k + 1 < all.line.size(); ++k) {
      CorridorCut one = all;
      one.line = {all.line[k], all.line[k + 1]};
      sides.push_back(make_surface(one));
    }
    const bool less = all.error < all.outside;
    const auto closer = [&](double a, double b) { return less ? std::min(a, b) : std::max(a, b); };
    int outside = 0;
    for (int k = 0; k < 200; ++k) {
      const Point p{random.uniform(-2500, 2500), random.uniform(-2500, 2500)};
      const double angle = random.uniform(0, 7), c = 7 * std::cos(angle), s = 7 * std::sin(angle);
      const Frame frame = Frame::from_trusted({p.x, c, -s, p.y, s, c});
      const LatticeRect rect{0, 0, random.uniform(1, 40), random.uniform(1, 40)};
      double at = sides[0]->at(p);
      ToleranceRange range = sides[0]->over(frame, rect);
      for (const auto& side : sides) {
        at = closer(at, side->at(p));
        const ToleranceRange one = side->over(frame, rect);
        range = {closer(range.low, one.low), closer(range.high, one.high)};
      }
      const ToleranceRange r = cut->over(frame, rect);
      EXPECT_EQ(cut->at(p), at);
      EXPECT_NEAR(r.low, range.low, 1e-6);
      EXPECT_NEAR(r.high, range.high, 1e-6);
      outside += std::abs(at - all.outside) < 1e-9;
    }
    EXPECT_LT(outside, 200);
  }
}

TEST_F(CutTest, NeighbouringRegionsOfOneCutTakeTheSamePatchesWhereTheyOverlap) {
  Random random(test_seed(5));
  for (int n = 0; n < 50; ++n) {
    CorridorCut left = random.corridor(1500), right = left;
    const double x = random.uniform(-800, 800);
    left.region = Region::inside(Extent{-2000, -2000, x, 2000});
    right.region = Region::inside(Extent{x, -2000, 2000, 2000});
    const auto in_both = [&](const Extraction& e) {
      std::set<PatchId> ids;
      for (const PatchId id : e.patches) {
        const Grid& g = db_->grid(id.grid());
        const GridShape::Block b{id.level(), id.bx(), id.by()};
        if (left.region.meets(g, b) && right.region.meets(g, b)) ids.insert(id);
      }
      return ids;
    };
    EXPECT_EQ(in_both(extract(*db_, left)), in_both(extract(*db_, right)));
  }
}

TEST_F(CutTest, AFieldSaysWhatItsPixelsSay) {
  const FieldCut f{.frame = Frame::from_trusted({100, 10, 0, 200, 0, -10}),
                   .width = 2,
                   .height = 2,
                   .tolerance = {1, 2, 3, NAN},
                   .outside = 9};
  const auto cut = make_surface(f);
  EXPECT_EQ(cut->at({100, 200}), 1);
  EXPECT_EQ(cut->at({104.9, 195.1}), 1);
  EXPECT_EQ(cut->at({105.1, 200}), 2);
  EXPECT_EQ(cut->at({100, 190}), 3);
  EXPECT_EQ(cut->at({110, 190}), 9);
  EXPECT_EQ(cut->at({94, 200}), 9);
  const ToleranceRange left = cut->over(f.frame, {-0.4, -0.4, 0.4, 1.4}),
                       all = cut->over(f.frame, {-9, -9, 9, 9});
  EXPECT_EQ(left.low, 1);
  EXPECT_EQ(left.high, 3);
  EXPECT_EQ(all.low, 1);
  EXPECT_EQ(all.high, 9);
}

TEST_F(CutTest, ADifferenceTurnsOneAnswerIntoTheOther) {
  Random random(test_seed(6));
  Extraction before = extract(*db_, {.error = 3});
  std::size_t kept = 0;
  for (int n = 0; n < 50; ++n) {
    const Extraction now = extract(*db_, *any_cut(random, 2000, n % 3));
    const Difference d = difference(now, before);
    std::set<PatchId> held(before.patches.begin(), before.patches.end());
    for (const PatchId id : d.drop) ASSERT_EQ(held.erase(id), 1u);
    kept += held.size();
    for (const PatchId id : d.add) ASSERT_TRUE(held.insert(id).second);
    EXPECT_EQ(std::vector<PatchId>(held.begin(), held.end()), sorted(now.patches));
    before = now;
  }
  EXPECT_GT(kept, 0u);
}

TEST_F(CutTest, ABudgetIsKeptAndItsErrorFallsWithIt) {
  double last = INFINITY;
  const std::size_t all = extract(*db_, {.error = 0}).patches.size();
  for (const std::size_t patches : {1u, 4u, 16u, 64u, 100000u}) {
    const Budgeted b = extract_within(*db_, {.patches = patches}, 1000,
                                      [](double error) { return make_surface(UniformCut{.error = error}); });
    EXPECT_LE(b.extraction.patches.size(), std::max<std::size_t>(patches, 1));
    EXPECT_LE(b.error, last);
    if (b.error > 0 && patches >= 4) {
      EXPECT_GT(extract(*db_, {.error = b.error * 0.999}).patches.size(), patches) << "no smaller error fits";
    }
    last = b.error;
  }
  EXPECT_EQ(last, 0);
  EXPECT_GT(all, 64u);
}

TEST_F(CutTest, WhatIsNoCutIsRefused) {
  EXPECT_NE(refusal_of([] { make_surface(UniformCut{.error = -1}); }), "");
  EXPECT_NE(refusal_of([] { make_surface(UniformCut{.error = NAN}); }), "");
  ViewCut v{.eye = {0, 0, 10}, .look = {5, 0, 0}, .far = 100, .highest = 50};
  EXPECT_EQ(refusal_of([&] { make_surface(v); }), "") << "the control";
  const auto refused = [&](auto spoil) {
    ViewCut bad = v;
    spoil(bad);
    return refusal_of([&] { make_surface(bad); });
  };
  EXPECT_NE(refused([](ViewCut& c) { c.look = c.eye; }), "");
  EXPECT_NE(refused([](ViewCut& c) { c.fov_degrees = 180; }), "");
  EXPECT_NE(refused([](ViewCut& c) { c.height = 0; }), "");
  EXPECT_NE(refused([](ViewCut& c) { c.pixel_error = -1; }), "");
  EXPECT_NE(refused([](ViewCut& c) { c.eye.x = NAN; }), "");
  EXPECT_NE(refused([](ViewCut& c) { c.far = 0; }), "");
  EXPECT_NE(refused([](ViewCut& c) { c.far = 1e101; }), "");
  EXPECT_NE(refused([](ViewCut& c) {
              c.look = {0, 0, std::nextafter(10.0, 11)}, c.pixel_error = 1e101;
            }),
            "");
  EXPECT_NE(refusal_of([] { make_surface(CorridorCut{.line = {{0, 0}}}); }), "");
  EXPECT_NE(refusal_of([] { make_surface(CorridorCut{.line = {{0, 0}, {1, 1}}, .ramp = -1}); }), "");
  EXPECT_EQ(refusal_of([] { make_surface(FieldCut{.width = 1, .height = 1, .tolerance = {2}}); }), "");
  EXPECT_NE(refusal_of([] { make_surface(FieldCut{.width = 1, .height = 2, .tolerance = {2}}); }), "");
  EXPECT_NE(refusal_of([] { make_surface(FieldCut{.width = 1, .height = 1, .tolerance = {-2}}); }), "");
  EXPECT_NE(refusal_of([] { make_surface(FieldCut{}); }), "");
}

}  // namespace
}  // namespace patchwork
