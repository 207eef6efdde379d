#include "db/coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <random>
#include <vector>

#include "db/coverage_exact.h"
#include "tests/db/coverage_scenes.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

using namespace coverage_test;

// --- Hard cases by name.

const LatticeRect kParent{28, -84, 84, -28};
const std::vector<LatticeRect> kChildren{
    {28, -84, 56, -56}, {56, -84, 84, -56}, {28, -56, 56, -28}, {56, -56, 84, -28}};

template <class Change>
std::vector<LatticeRect> changed(std::vector<LatticeRect> rects, Change change) {
  for (LatticeRect& r : rects) r = change(r);
  return rects;
}

void expect_nesting(const OrientedRect& parent, const std::vector<OrientedRect>& children,
                    CoverageCounts& counts) {
  for (const OrientedRect& c : children) EXPECT_TRUE(ask(c, {parent}, &counts));
  EXPECT_TRUE(ask(parent, children, &counts));
  EXPECT_FALSE(ask(parent, {children[0], children[1], children[3]}, &counts));
  OrientedRect beyond = children[0];
  beyond.rect.j0 = std::nextafter(beyond.rect.j0, -INFINITY);
  EXPECT_FALSE(ask(beyond, {parent}, &counts)) << "one ulp of a lattice coordinate beyond the parent";
}

TEST(CoverageRotatedNesting, ParentCoversItsChildrenAndTheyCoverIt) {
  CoverageCounts own, foreign;
  int missed_by_rounded_corners = 0;
  for (const double angle : kAngles)
    for (const double origin : kOrigins) {
      const Frame f = frame(angle, 10, 7.3, origin, origin / 3), back = reversed(f), twice = doubled(f);
      expect_nesting({&f, kParent}, placed(f, kChildren), own);
      expect_nesting({&back, reversed(kParent)}, placed(f, kChildren), foreign);
      expect_nesting({&f, kParent},
                     placed(twice, changed(kChildren, [](const LatticeRect& r) { return doubled(r); })),
                     foreign);
      for (const LatticeRect& c : kChildren)
        missed_by_rounded_corners += !corners_covered({&f, c}, {{&twice, doubled(kParent)}});
    }
  EXPECT_EQ(own.interval + own.exact, 0u) << "one frame is decided by integers";
  EXPECT_GT(foreign.exact, 0u);
  EXPECT_GT(missed_by_rounded_corners, 0) << "negative control: rounded corners must miss children";
  report_law("CoverageRotatedNesting", "parents and children, 7 angles, 3 origins",
             own.integer + foreign.interval + foreign.exact);
}

TEST(CoverageAbutting, ASeamOfOneUlpIsClosedByGrowthAlone) {
  const double x = kFar + 0.1, seam = x + 2800;
  const Frame coarse = frame(0.2, 25, 25, seam - 300, 1000);
  const OrientedRect target{&coarse, {0, 0, 28, 28}};
  const Frame a = frame(0, 10, 10, x, 0);
  const LatticeRect tile{0, 0, 280, 280};
  const auto two_tiles = [&](double start, bool grow) {
    const Frame b = frame(0, 10, 10, start, 0);
    CoverageCounts counts;
    const LatticeRect r = grow ? grown(tile) : tile;
    const bool answer = ask(target, {{&a, r}, {&b, r}}, &counts);
    EXPECT_EQ(counts.exact, !grow && start == seam ? 1u : 0u)
        << "only edges that coincide need the rationals";
    return answer;
  };
  const double gap = std::nextafter(seam, INFINITY), overlap = std::nextafter(seam, -INFINITY);
  for (const double start : {overlap, seam, gap}) EXPECT_TRUE(two_tiles(start, true));
  EXPECT_TRUE(two_tiles(seam, false));
  EXPECT_TRUE(two_tiles(overlap, false));
  EXPECT_FALSE(two_tiles(gap, false)) << "negative control: without growth the hairline is real";
  report_law("CoverageAbutting", "seams of one ulp, 1e7 m from the origin", 6);
}

TEST(CoverageAbutting, RotatedTilesWhoseAnchorsWereRounded) {
  int open = 0;
  for (const double angle : kAngles) {
    const Frame a = frame(angle, 10, 10, kFar, kFar / 2);
    const Point anchor = a.to_domain(280, 0);
    const auto& n = a.numbers();
    const Frame b = Frame::from_trusted({anchor.x, n[1], n[2], anchor.y, n[4], n[5]});
    const OrientedRect target{&a, {224, 56, 336, 168}};
    EXPECT_TRUE(ask(target, {{&a, grown({0, 0, 280, 280})}, {&b, grown({0, 0, 280, 280})}}));
    open += !ask(target, {{&a, {0, 0, 280, 280}}, {&b, {0, 0, 280, 280}}});
  }
  EXPECT_GT(open, 0) << "negative control: some seam is open without growth";
}

// Naive: the target's area less its parts in two disjoint covers, all in double.
double area(const std::array<Point, 4>& c) {
  double twice = 0;
  for (std::size_t k = 0; k < 4; ++k) twice += c[k].x * c[(k + 1) % 4].y - c[(k + 1) % 4].x * c[k].y;
  return std::abs(twice) / 2;
}

struct Halves {  // [28, 56] x [-56, -28] in two parts with a gap of `gap` cells in the middle, in reversed
                 // numbers
  Frame f, back;
  OrientedRect target;
  Halves(double angle, double step) : f(frame(angle, step, step, kFar, kFar / 2)), back(reversed(f)) {
    target = {&f, {28, -56, 56, -28}};
  }
  std::vector<OrientedRect> covers(double gap, double growth) const {
    return {{&back, grown(reversed(LatticeRect{28, -56, 42 - gap / 2, -28}), growth)},
            {&back, grown(reversed(LatticeRect{42 + gap / 2, -56, 56, -28}), growth)}};
  }
  bool covered_by_area(double gap) const {
    const auto c = covers(gap, 0);
    return area(corners(target)) - area(corners(c[0])) - area(corners(c[1])) <= 0;
  }
};

TEST(CoverageSliver, GrowthClosesAHairlineAndNothingWider) {
  int wrong = 0;
  for (const double step : {30.0, 1.0, 0.01})
    for (const double angle : {0.0, 1e-9, 0.3, 1.1}) {
      const Halves h(angle, step);
      const auto closed = [&](double gap, double growth) { return ask(h.target, h.covers(gap, growth)); };
      EXPECT_TRUE(closed(1.0 / 2048, kGrowth));
      EXPECT_TRUE(closed(1.0 / 512, kGrowth)) << "twice the growth: closed sets touch";
      EXPECT_FALSE(closed(1.0 / 512 + 0x1p-40, kGrowth));
      EXPECT_FALSE(closed(1.0 / 256, kGrowth));
      for (const double gap : {1.0 / 512, 1.0 / 2048, 0x1p-40}) EXPECT_FALSE(closed(gap, 0));
      EXPECT_TRUE(closed(0, 0));
      for (const double gap : {0.0, 1.0 / 512, 1.0 / 2048}) wrong += h.covered_by_area(gap) != (gap == 0);
    }
  EXPECT_GT(wrong, 0) << "negative control: areas in double decide by rounding";
  report_law("CoverageSliver", "gaps of 1/256 to 1/2048 cell, steps of 1 cm to 30 m, 1e7 m from the origin",
             12 * 8);
}

TEST(CoverageSliver, ACoverThatEndsShortOfTheTarget) {
  for (const double step : {30.0, 1.0, 0.01}) {
    const Halves h(0.3, step);
    const auto reaches = [&](double gap) {
      return ask(h.target, {{&h.back, grown(reversed(LatticeRect{20, -60, 56 - gap, -20}))}});
    };
    EXPECT_FALSE(reaches(1.0 / 512));
    EXPECT_FALSE(reaches(kGrowth + 0x1p-40));
    EXPECT_TRUE(reaches(kGrowth));
    EXPECT_TRUE(reaches(1.0 / 2048));
  }
}

// --- Laws over random scenes.

TEST(Coverage, AgreesWithLookingAroundEveryCrossing) {
  std::mt19937_64 rng = seeded();
  int yes = 0, no = 0, corners_wrong = 0;
  for (int k = 0; k < 2000; ++k) {
    const Scene s = random_scene(rng, 0);
    const double hair = 1e-7 * s.target.frame->step_i();
    const bool answer = ask(s.target, s.covers);
    ASSERT_EQ(answer, covered_by_looking(s.target, s.covers, hair)) << "scene " << k;
    (answer ? yes : no)++;
    corners_wrong += corners_covered(s.target, s.covers) != answer;
  }
  EXPECT_GT(yes, 100);
  EXPECT_GT(no, 100);
  EXPECT_GT(corners_wrong, 20) << "negative control: looking at corners alone must be caught";
}

TEST(Coverage, FilterAgreesWithExactArithmetic) {
  std::mt19937_64 rng = seeded();
  CoverageCounts loose, tight;
  for (int k = 0; k < 10000; ++k) {
    const double origin = kOrigins[k % 3];
    const Scene s = k % 2 ? random_scene(rng, origin) : tight_scene(rng, origin);
    ASSERT_EQ(ask(s.target, s.covers, k % 2 ? &loose : &tight), coverage::covered_exact(s.target, s.covers))
        << "scene " << k;
  }
  EXPECT_GT(loose.interval, 100 * loose.exact) << "the filter decides where nothing coincides";
  EXPECT_GT(tight.integer, 0u);
  EXPECT_GT(tight.interval, 0u);
  EXPECT_GT(tight.exact, 0u) << "negative control: coinciding edges are beyond the filter";
}

TEST(Coverage, OrderOfCoversNeverMatters) {
  std::mt19937_64 rng = seeded();
  for (int k = 0; k < 1000; ++k) {
    Scene s = k % 2 ? random_scene(rng, kFar) : tight_scene(rng, kFar);
    const bool answer = ask(s.target, s.covers);
    for (int n = 0; n < 6; ++n) {
      std::shuffle(s.covers.begin(), s.covers.end(), rng);
      ASSERT_EQ(ask(s.target, s.covers), answer) << "scene " << k;
    }
  }
}

TEST(Coverage, ManyCoversAndManyPieces) {
  const Frame f = frame(0.1, 3, 3, kFar, 0), g = frame(0.5, 1, 1, kFar + 40, 40);
  std::vector<OrientedRect> tiles;
  for (int i = -60; i < 60; i += 5)
    for (int j = -60; j < 60; j += 5) tiles.push_back({&g, grown({1.0 * i, 1.0 * j, i + 5.0, j + 5.0})});
  const OrientedRect target{&f, {6, 6, 20, 20}};
  EXPECT_TRUE(ask(target, tiles));
  std::size_t hole = 0;
  while (!contains(tiles[hole], f.to_domain(13, 13))) ++hole;
  tiles.erase(tiles.begin() + static_cast<std::ptrdiff_t>(hole));
  EXPECT_FALSE(ask(target, tiles));
}

TEST(Coverage, RoundPiecesOutgrowTheFilterAndAreStillRight) {
  const Frame own = frame(0, 1, 1, kFar, kFar);
  const OrientedRect target{&own, {-20, -20, 20, 20}};
  std::deque<Frame> frames;
  std::vector<OrientedRect> ring;  // leaves a polygon of 24 edges around the centre
  for (int k = 0; k < 24; ++k) {
    frames.push_back(frame(0.01 + k * 0.2617993877991494, 1, 1, kFar, kFar));
    ring.push_back({&frames.back(), {10, -60, 90, 60}});
  }
  EXPECT_FALSE(ask(target, ring));
  CoverageCounts counts;
  ring.push_back({&frames[3], {-11, -11, 11, 11}});
  EXPECT_TRUE(ask(target, ring, &counts));
  EXPECT_EQ(counts.exact, 1u);
}

TEST(Coverage, AnEdgeThroughTwoCornersKeepsBothHalvesWhole) {
  const Frame own = frame(0, 1, 1, 0, 0), diagonal = Frame::from_trusted({0, 1, -1, 0, 1, 1});
  const OrientedRect target{&own, {0, 0, 4, 4}};
  std::vector<OrientedRect> covers{{&diagonal, {-9, -9, 9, 0}}, {&diagonal, {1, 1, 3, 3}}};
  EXPECT_FALSE(ask(target, covers));
  EXPECT_FALSE(coverage::covered_exact(target, covers));
  covers.push_back({&diagonal, {-9, 0, 9, 9}});
  EXPECT_TRUE(ask(target, covers));
  EXPECT_TRUE(coverage::covered_exact(target, covers));
  covers = {{&diagonal, {2, -9, 9, 1}}, {&diagonal, {-9, -9, 2, 9}}};
  EXPECT_FALSE(ask(target, covers));
  EXPECT_FALSE(coverage::covered_exact(target, covers));
}

TEST(Coverage, EmptyRectanglesAndNoCovers) {
  const Frame f = frame(0.1, 3, 3, kFar, 0), g = reversed(f);
  const LatticeRect unit{0, 0, 1, 1}, empty{1, 0, 0, 1};
  EXPECT_FALSE(ask({&f, unit}, {}));
  EXPECT_TRUE(ask({&f, empty}, {}));
  EXPECT_FALSE(ask({&f, unit}, {{&g, {0, -1, -1, 2}}, {&f, {2, -1, -1, 2}}}));
}

TEST(Coverage, NumbersTooLargeForTheFilterGoToTheRationals) {
  const Frame f = frame(0.1, 1e140, 1e140, 0, 0), g = reversed(f);
  CoverageCounts counts;
  EXPECT_TRUE(ask({&f, {0, 0, 1, 1}}, {{&g, {-2, -1, 1, 2}}}, &counts));
  EXPECT_FALSE(ask({&f, {0, 0, 1, 1}}, {{&g, {-0.5, -1, 1, 2}}}, &counts));
  EXPECT_EQ(counts.exact, 2u);
}

// --- Areas.

int compare(const OrientedRect& a, const OrientedRect& b, CoverageCounts& counts) {
  CoverageCounts c;
  const int sign = compare_areas(a, b, c);
  EXPECT_EQ(c.integer + c.interval + c.exact, 1u);
  EXPECT_EQ(compare_areas(b, a, c), -sign);
  EXPECT_EQ(coverage::compare_areas_exact(a, b), sign);
  counts += c;
  return sign;
}

TEST(CompareAreas, SeesOneUlp) {
  CoverageCounts own, turned;
  const Frame f = frame(0.3, 10, 7.3, kFar, 1), elsewhere = frame(0.3, 10, 7.3, -3, 1), back = reversed(f);
  const LatticeRect r{0, 0, 28, 28}, more{0, 0, std::nextafter(28, 29), 28}, moved{-56, 28, -28, 56};
  EXPECT_EQ(compare({&f, r}, {&elsewhere, moved}, own), 0);
  EXPECT_EQ(compare({&f, r}, {&elsewhere, more}, own), -1);
  EXPECT_EQ(own.interval + own.exact, 0u);
  EXPECT_EQ(compare({&f, r}, {&back, moved}, turned), 0);
  EXPECT_EQ(compare({&back, more}, {&f, r}, turned), 1);
  EXPECT_EQ(compare({&f, r}, {&back, {0, 0, 28, 28.5}}, turned), -1);
  EXPECT_GT(turned.exact, 0u);
  EXPECT_GT(turned.interval, 0u);
}

TEST(CompareAreas, RoundedSidesAreNotTakenForExact) {
  const Frame f = frame(0.3, 10, 7.3, kFar, 1);
  const LatticeRect wide{-0x1p-60, 0, 28, 28}, plain{0, 0, 28, 28};
  EXPECT_EQ(wide.i1 - wide.i0, plain.i1 - plain.i0) << "negative control: the difference is lost in double";
  CoverageCounts counts;
  EXPECT_EQ(compare({&f, wide}, {&f, plain}, counts), 1);
}

TEST(CompareAreas, RoundedProductsAreNotTakenForExact) {
  const Frame f = frame(0.3, 10, 7.3, kFar, 1);
  const LatticeRect oblong{0, 0, 1 + 0x1p-30, 1 - 0x1p-30}, square{0, 0, 1, 1};
  EXPECT_EQ(oblong.i1 * oblong.j1, 1) << "negative control: the difference is lost in double";
  CoverageCounts counts;
  EXPECT_EQ(compare({&f, oblong}, {&f, square}, counts), -1);
}

TEST(CompareAreas, AgreesWithExactArithmetic) {
  std::mt19937_64 rng = seeded();
  CoverageCounts counts;
  int undecided_by_products = 0;
  for (int k = 0; k < 10000; ++k) {
    const Frame f = frame(uniform(rng, -4, 4), 10, 7, 0, 0),
                g = frame(uniform(rng, -4, 4), 10, k % 2 ? 7 : -7, 5, 5);
    const OrientedRect a{&f, {0, 0, 28, 28}}, b{&g, {0, 0, 28, k % 3 ? 28 : uniform(rng, 27, 29)}};
    const int sign = compare(a, b, counts);
    undecided_by_products += sign != 0 && f.cell_area() * 28 * 28 == g.cell_area() * 28 * b.rect.j1;
  }
  EXPECT_GT(undecided_by_products, 0) << "negative control: rounded products call unequal areas equal";
}

}  // namespace
}  // namespace patchwork
