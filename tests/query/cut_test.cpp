// Cuts: what they range over, which patches they take, how answers differ and keep to a budget.
#include "query/cut.h"

#include <gtest/gtest.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <random>
#include <set>

#include "query/extract.h"
#include "query/view_page.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

class Random {
 public:
  explicit Random(std::uint64_t seed) : random_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  std::size_t below(std::size_t n) { return random_() % n; }

  ViewCut view(double side) {
    ViewCut v{.eye = {uniform(-side, side), uniform(-side, side), uniform(10, side)}, .look = {}};
    v.look = {uniform(-side, side), uniform(-side, side), uniform(-100, 300)};
    if (below(8) == 0) v.look = {v.eye.x, v.eye.y, v.eye.z - 100};  // straight down
    v.fov_degrees = uniform(10, 100), v.pixel_error = std::exp2(uniform(-1, 4)),
    v.far = uniform(100, 4 * side);
    v.lowest = -60, v.highest = 250;
    v.in_space = below(2) == 0;
    return v;
  }
  FieldCut field(double side) {
    const double angle = uniform(0, 7), step = uniform(0.002, 0.03) * side;
    FieldCut f{
        .frame = Frame::from_trusted({uniform(-side, side), step * std::cos(angle), -step * std::sin(angle),
                                      uniform(-side, side), step * std::sin(angle), step * std::cos(angle)}),
        .width = 1 + int(below(90)),
        .height = 1 + int(below(90)),
        .tolerance = {},
        .outside = uniform(0, 50)};
    for (int k = 0; k < f.width * f.height; ++k)
      f.tolerance.push_back(below(9) == 0 ? NAN : float(std::exp2(uniform(-3, 6))));
    return f;
  }
  CorridorCut corridor(double side) {
    CorridorCut c;
    for (int k = 0; k < 4; ++k) c.line.push_back({uniform(-side, side), uniform(-side, side)});
    c.error = uniform(0, 2), c.outside = uniform(2, 100), c.width = uniform(0, 100), c.ramp = uniform(0, 300);
    return c;
  }
  UniformCut uniform_cut(double side) {
    const double x = uniform(-side, side), y = uniform(-side, side), a = uniform(1, side);
    return {.error = std::exp2(uniform(-4, 7)), .region = Region::inside(Extent{x, y, x + a, y + a})};
  }

 private:
  std::mt19937_64 random_;
};

// Axes whose angle has this cosine.
Frame sheared(Random& random, double cosine) {
  const double angle = random.uniform(0, 7), other = angle + std::acos(cosine), i = random.uniform(1, 20),
               j = random.uniform(1, 20);
  return Frame::from_trusted({random.uniform(-2000, 2000), i * std::cos(angle), j * std::cos(other),
                              random.uniform(-2000, 2000), i * std::sin(angle), j * std::sin(other)});
}

std::unique_ptr<CutSurface> any_cut(Random& random, double side, int kind) {
  if (kind == 0) return make_surface(random.uniform_cut(side));
  if (kind == 1) return make_surface(random.view(side));
  return kind == 3 ? make_surface(random.field(side)) : make_surface(random.corridor(side));
}

// --- Boxes alone: what a page's vector code accepts against the cut's own range and region, box by box.

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

// --- Extractions of a database.

double rough(double x, double y) {
  return 40 * std::sin(x / 170) * std::cos(y / 130) + 5 * std::sin(x / 21 + y / 37) + std::sin(x * 1.7 + y);
}

class CutTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new GridFolder;
    db_ = new Database(folder_->database());
    folder_->add(
        *db_,
        of_terrain(
            {.width = 300, .height = 280, .geotransform = rotated(-1500, 1400, 0, 10, 10), .accuracy = 1},
            rough),
        "base");
    folder_->add(
        *db_, of_terrain({.width = 250, .height = 200, .geotransform = rotated(-300, 200, 25, 3, 3)}, rough),
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
