// What a page's vector code accepts of boxes, against the cut's own range and region, box by box.
#include <gtest/gtest.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cmath>
#include <set>

#include "query/view_page.h"
#include "tests/grids.h"
#include "tests/query/random_cuts.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

LodEntry random_box(Random& random, std::uint64_t id) {
  const double side = std::exp2(random.uniform(2, 9)), x = random.uniform(-3000, 3000),
               y = random.uniform(-3000, 3000), error = side * random.uniform(0.01, 0.1);
  LodBox b{x, y, x + side, y + side, float(error), float(error * random.uniform(1, 4))};
  if (id % 5 == 0) b.bottom = 0;
  if (id % 7 == 0) b.top = INFINITY;
  return {b, {id}};
}

// The grid whose one block of level 0 has exactly this domain, to ask the cut of it.
struct AsGrid {
  explicit AsGrid(const LodBox& b) {
    const double step = (b.xmax - b.xmin) / 20;
    grid.info.frame = Frame::from_trusted({b.xmin, step, 0, b.ymin, 0, (b.ymax - b.ymin) / 20});
    grid.info.shape = GridShape(21, 21, false);
  }
  Grid grid;
};

// The cut's own range and region, of the box as a patch.
bool is_meant(const CutSurface& cut, const LodBox& box) {
  const AsGrid as(box);
  const ToleranceRange r = cut.over(as.grid.info.frame, as.grid.info.shape.domain(0, 0, 0));
  return double(box.bottom) <= r.high && r.low < double(box.top) && cut.meets(as.grid, {0, 0, 0});
}

void expect_no_box_missed(const LodTree& tree, const std::vector<LodEntry>& all, const CutSurface& cut,
                          std::size_t& found, std::size_t& spare) {
  std::set<std::uint64_t> hit;
  tree.visit([&](const LodPage& page, bool inside) { return cut.hits(page, inside); },
             [&](const LodEntry& e) { hit.insert(e.id.value); });
  std::size_t exact = 0;
  for (const LodEntry& e : all) {
    if (!is_meant(cut, e.box)) continue;
    ++exact;
    ASSERT_TRUE(hit.contains(e.id.value))
        << "a box that the cut meets was not visited: "
        << testing::PrintToString(std::vector<double>{e.box.xmin, e.box.ymin, e.box.xmax, e.box.ymax,
                                                      double(e.box.bottom), double(e.box.top)});
  }
  found += exact, spare += hit.size() - exact;
}

class LodTreeCuts : public testing::TestWithParam<int> {};

TEST_P(LodTreeCuts, AgreeWithScanningEveryBoxBeforeAndAfterChanges) {
  Random random(test_seed(1));
  std::vector<LodEntry> all;
  // PATCHWORK_TRIALS=10000 asks as many cuts as the design does, over as many boxes.
  const std::uint64_t boxes = test_trials(1) >= 10000 ? 100000 : 20000;
  for (std::uint64_t k = 0; k < boxes; ++k) all.push_back(random_box(random, k));
  LodTree tree = LodTree::build(all);
  std::size_t found = 0, spare = 0;
  for (int n = 0; n < test_trials(60); ++n) {
    expect_no_box_missed(tree, all, *any_cut(random, 3000, GetParam()), found, spare);
    if (n % 3) continue;
    for (int change = 0; change < 30; ++change) {
      std::swap(all[random.below(all.size())], all.back());
      ASSERT_TRUE(tree.erase(all.back()));
      all.back() = random_box(random, 1000000 + std::uint64_t(n) * 100 + std::uint64_t(change));
      tree.insert(all.back());
    }
  }
  EXPECT_GT(found, 1000u);
  EXPECT_LE(double(spare), 0.25 * double(found) + 100) << "boxes near the sides of a view, no more";
}

INSTANTIATE_TEST_SUITE_P(UniformViewCorridorField, LodTreeCuts, testing::Range(0, 4));

// A view compares boxes as floats: none may be lost to what these cannot hold, wherever the land lies,
// however large it is and however small or large its tolerances are; with every instruction set that this
// machine has.
TEST(ViewCutsOfPages, MissNoBoxWhateverTheNumbersAndTheInstructions) {
  Random random(test_seed(21));
  std::size_t found = 0, spare = 0;
  const auto ask = [&](const LodTree& tree, const std::vector<LodEntry>& all, const ViewCut& v, bool count) {
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      SCOPED_TRACE(hwy::TargetName(target));
      std::size_t ignored = 0;
      expect_no_box_missed(tree, all, *make_surface(v), found, count ? spare : ignored);
    }
    hwy::SetSupportedTargetsForTest(0);
  };
  for (const double away : {0.0, 5e6, -3e9})
    for (const double size : {1e-5, 1.0, 1e7}) {
      const auto placed = [&](double v) { return away * std::max(size, 1.0) + size * v; };
      std::vector<LodEntry> all;
      for (std::uint64_t k = 0; k < 3000; ++k) {
        LodEntry e = random_box(random, k);
        LodBox& b = e.box;
        b = {placed(b.xmin), placed(b.ymin),         placed(b.xmax),
             placed(b.ymax), b.bottom * float(size), b.top * float(size)};
        if (b.xmin < b.xmax && b.ymin < b.ymax) all.push_back(e);
      }
      const LodTree tree = LodTree::build(all);
      for (int n = 0; n < 40; ++n) {
        ViewCut v = random.view(3000);
        v.eye = {placed(v.eye.x), placed(v.eye.y), size * v.eye.z};
        v.look = {placed(v.look.x), placed(v.look.y), size * v.look.z};
        v.far *= size, v.lowest *= size, v.highest *= size;
        if (n % 10 == 7) v.pixel_error = 0;
        if (n % 10 == 8) v.pixel_error = 1e-30;
        if (n % 10 == 9) v.pixel_error = 1e30;
        ask(tree, all, v, n % 10 < 7);
      }
    }
  EXPECT_GT(found, 1000u);
  EXPECT_LE(double(spare), 0.25 * double(found) + 100) << "and few that it does not meet";
}

// Import takes frames whose axes are a hair from orthogonal. Boxes that a patch's range barely meets tell
// whether what the page compares holds that range.
TEST(ViewCutsOfPages, MissNoPatchOfAShearedFrame) {
  Random random(test_seed(22));
  std::size_t met = 0, beyond = 0;
  for (int n = 0; n < 3000; ++n) {
    Grid grid;
    const Frame& f = grid.info.frame = sheared(random, n % 3 ? Frame::kMostShear : -Frame::kMostShear);
    grid.info.shape = GridShape(21, 21, false);
    // From far away along a diagonal of its cells, where shear changes distances most.
    const double away = std::exp2(random.uniform(8, 20)), i = away / f.step_i(), j = away / f.step_j();
    const Point eye = f.to_domain(10 - i, n % 2 ? 10 - j : 10 + j), look = f.to_domain(10, 10);
    ViewCut v = random.view(3000);
    v.eye = {eye.x, eye.y, n % 4 < 2 ? 100.0 : 1000.0}, v.look = {look.x, look.y, 0}, v.far = 1.6 * away;
    const auto cut = make_surface(v);
    const LatticeRect domain = grid.info.shape.domain(0, 0, 0);
    const ToleranceRange r = cut->over(grid.info.frame, domain);
    const Extent e = grid.info.frame.bounds(domain);
    if (!cut->meets(grid, {0, 0, 0}) || r.low == 0) continue;
    LodPage page(0);
    const auto add = [&](float bottom, float top) {
      page.append({{e.xmin, e.ymin, e.xmax, e.ymax, bottom, top}, {page.count}});
    };
    add(float_at_most(r.high), INFINITY), add(0, std::nextafter(float_at_least(r.low), INFINITY));
    add(float(r.high * 1.01), INFINITY), add(0, float(r.low * 0.99));
    const std::uint64_t hits = cut->hits(page, false).met;
    ASSERT_EQ(hits & 3, 3u) << n;
    ++met, beyond += (hits & 12) == 0;
  }
  EXPECT_GT(met, 300u);
  EXPECT_GT(beyond, met / 10) << "and it holds little more";
}

// What a view sees has few corners however its numbers round, and one beyond all lengths is refused.
TEST(ViewCutsOfPages, TakeViewsOfAnySize) {
  Random random(test_seed(23));
  LodPage page(0);
  for (std::uint64_t k = 0; k < LodPage::kSlots; ++k) page.append(random_box(random, k));
  std::size_t most = 0, regions = 0, met = 0;
  for (int n = 0; n < 20000; ++n) {
    ViewCut v = random.view(3000);
    const auto scale = [&] { return std::exp2(random.uniform(-300, 330)); };
    const double size = n % 2 ? scale() : 1;
    for (double* c : {&v.eye.x, &v.eye.y, &v.eye.z, &v.look.x, &v.look.y, &v.look.z, &v.lowest, &v.highest})
      *c = std::clamp(*c * (n % 4 == 3 ? scale() : size), -1e100, 1e100);
    v.far = std::min(v.far * size, 1e100);
    if (v.lowest > v.highest) std::swap(v.lowest, v.highest);
    if (n % 5 == 0) v.lowest = v.highest;
    if (n % 7 == 0) v.fov_degrees = std::nextafter(180.0, 0.0);
    if (n % 11 == 0)
      v.eye.x = v.look.x, v.eye.y = v.look.y, v.look.z = v.eye.z - std::copysign(1e-9 * v.far, v.eye.z);
    if (std::hypot(v.look.x - v.eye.x, v.look.y - v.eye.y, v.look.z - v.eye.z) < 1e-99) continue;
    const std::vector<Point> corners = footprint(v);
    for (const Point& p : corners) ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y)) << n;
    most = std::max(most, corners.size()), regions += corners.size() >= 3;
    const auto cut = make_surface(v);
    const std::uint64_t hits = cut->hits(page, false).met;
    for (std::uint32_t s = 0; s < page.count; ++s) {
      const bool hit = (hits >> s & 1) != 0, meant = is_meant(*cut, page.box(s));
      ASSERT_TRUE(hit || !meant) << n << " " << s;
      met += meant;
    }
  }
  EXPECT_GT(met, 10000u);
  EXPECT_GT(regions, 5000u);
  EXPECT_LE(most, PageView::kMostSides);
  // What is seen is so small that it has no area.
  const auto speck = make_surface(
      ViewCut{.eye = {0, 0, 1e-170}, .look = {1, 0, -1}, .far = 3e-170, .lowest = 0, .highest = 0});
  EXPECT_EQ(speck->hits(page, false).met, 0u);
  // No error is allowed, whatever its sign, and boxes beyond the region are told apart.
  ViewCut exact{.eye = {0, 0, 100}, .look = {100, 0, 0}, .far = 1000, .lowest = 0, .highest = 0};
  LodPage near(0);
  near.append({{100, -1, 101, 1, 0, INFINITY}, {0}}), near.append({{-9000, 0, -8999, 1, 0, INFINITY}, {1}});
  for (const double pixels : {0.0, -0.0}) {
    exact.pixel_error = pixels;
    EXPECT_EQ(make_surface(exact)->hits(near, false).met, 1u) << pixels;
  }
  // An eye that nearly touches the plane, and tolerances that grow fast.
  const auto touching = make_surface(ViewCut{.eye = {0, 0, 3.24e-23},
                                             .look = {1, 0, 0},
                                             .pixel_error = 6.24e8,
                                             .far = 10,
                                             .lowest = 0,
                                             .highest = 0,
                                             .in_space = true});
  LodPage under(0);
  under.append({{-1, -1, 1, 1, 0, 3.4e-17f}, {0}});
  EXPECT_TRUE(is_meant(*touching, under.box(0)));
  EXPECT_EQ(touching->hits(under, false).met, 1u);
  EXPECT_NE(refusal_of([] {
              make_surface(ViewCut{.eye = {1, 0, 1.7e308},
                                   .look = {1.2178443318775637e307, 0, 8.500000000000001e306},
                                   .fov_degrees = 100,
                                   .far = 8.5e307,
                                   .lowest = -1.7e308,
                                   .highest = 1.7e308});
            }),
            "");
}

}  // namespace
}  // namespace patchwork
