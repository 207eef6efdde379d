// Regions: a patch meets a region exactly if its domain does; what is no region is refused.
#include "query/region.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

using Corners = std::vector<Point>;

// How far apart two convex polygons are along the best of their edges' normals; negative if they overlap.
double separation(const Corners& a, const Corners& b) {
  double most = -INFINITY;
  for (const Corners* sides : {&a, &b})
    for (std::size_t k = 0; k < sides->size(); ++k) {
      const Point p = (*sides)[k], q = (*sides)[(k + 1) % sides->size()];
      const double length = std::hypot(q.x - p.x, q.y - p.y), nx = (q.y - p.y) / length,
                   ny = (p.x - q.x) / length;
      double range[2][2] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}};
      for (const int which : {0, 1})
        for (const Point& v : which ? b : a) {
          const double d = nx * v.x + ny * v.y;
          range[which][0] = std::min(range[which][0], d), range[which][1] = std::max(range[which][1], d);
        }
      most = std::max({most, range[0][0] - range[1][1], range[1][0] - range[0][1]});
    }
  return most;
}

Corners corners(const Extent& e) {
  return {{e.xmin, e.ymin}, {e.xmax, e.ymin}, {e.xmax, e.ymax}, {e.xmin, e.ymax}};
}

Corners domain_of(const Grid& g, const GridShape::Block& b) {
  const LatticeRect d = g.info.shape.domain(b.level, b.bx, b.by);
  const Frame& f = g.info.frame;
  return {f.to_domain(d.i0, d.j0), f.to_domain(d.i1, d.j0), f.to_domain(d.i1, d.j1), f.to_domain(d.i0, d.j1)};
}

Grid grid_at(double degrees, int mirror = 1) {
  Grid g;
  std::array<double, 6> gt = rotated(500, 900, degrees, 10, 8);
  gt[2] *= mirror, gt[5] *= mirror;
  g.info.frame = Frame::from_geotransform(gt, "test");
  g.info.shape = GridShape(150, 120, true);
  return g;
}

Extent random_extent(std::mt19937_64& random) {
  std::uniform_real_distribution<double> at(-1500, 3000), side(0, 700);
  const double x = at(random), y = at(random);
  return {x, y, x + side(random), y + side(random)};
}

// Compares with the reference over all blocks; returns how many blocks only their upright bounds would let
// in.
std::size_t expect_meets(const Region& region, const std::vector<Corners>& convex_parts, const Grid& g) {
  std::size_t only_bounds = 0;
  for (std::size_t k = 0; k < g.info.shape.blocks(); ++k) {
    const GridShape::Block b = g.info.shape.block(k);
    double apart = INFINITY;
    for (const Corners& part : convex_parts) apart = std::min(apart, separation(part, domain_of(g, b)));
    if (std::abs(apart) < 1e-6) continue;  // rounding may decide
    EXPECT_EQ(region.meets(g, b), apart < 0) << "level " << b.level << " block " << b.bx << " " << b.by;
    const LatticeRect d = g.info.shape.domain(b.level, b.bx, b.by);
    only_bounds += apart > 0 && g.info.frame.bounds(d).meets(region.bounds());
  }
  return only_bounds;
}

TEST(Region, EverywhereMeetsEveryPatch) {
  const Grid g = grid_at(33);
  for (std::size_t k = 0; k < g.info.shape.blocks(); ++k)
    EXPECT_TRUE(Region().meets(g, g.info.shape.block(k)));
}

TEST(Region, AnExtentMeetsRotatedDomainsAsSeparatingAxesSay) {
  std::mt19937_64 random(test_seed(1));
  std::size_t only_bounds = 0;
  for (const double degrees : {0.0, 90.0, 1e-7, 30.0, -45.0, 120.0})
    for (const int mirror : {1, -1})
      for (int n = 0; n < 50; ++n) {
        const Extent e = random_extent(random);
        only_bounds += expect_meets(Region::inside(e), {corners(e)}, grid_at(degrees, mirror));
      }
  EXPECT_GT(only_bounds, 0u) << "negative control: upright bounds alone let in too much";
}

TEST(Region, AnExtentWithoutAreaMeetsTheDomainsThatHoldIt) {
  const Grid g = grid_at(30);
  std::mt19937_64 random(test_seed(2));
  std::uniform_real_distribution<double> i(-30, 180), j(-30, 150);
  for (int n = 0; n < 200; ++n) {
    const double u = i(random), v = j(random);
    const Point p = g.info.frame.to_domain(u, v);
    const Region region = Region::inside(Extent{p.x, p.y, p.x, p.y});
    for (std::size_t k = 0; k < g.info.shape.blocks(); ++k) {
      const GridShape::Block b = g.info.shape.block(k);
      const LatticeRect d = g.info.shape.domain(b.level, b.bx, b.by);
      const bool holds = u >= d.i0 && u <= d.i1 && v >= d.j0 && v <= d.j1;
      EXPECT_EQ(region.meets(g, b), holds) << u << " " << v;
    }
  }
}

TEST(Region, AConvexPolygonMeetsInEitherTurn) {
  std::mt19937_64 random(test_seed(3));
  for (const double degrees : {0.0, 30.0})
    for (int n = 0; n < 50; ++n) {
      const Extent e = random_extent(random);
      const Corners kite{{e.xmin, (e.ymin + e.ymax) / 2},
                         {(e.xmin + e.xmax) / 2, e.ymin},
                         {e.xmax, (e.ymin + e.ymax) / 2},
                         {(e.xmin + e.xmax) / 2, e.ymax}};
      const Corners turned(kite.rbegin(), kite.rend());
      expect_meets(Region::inside(kite), {kite}, grid_at(degrees));
      expect_meets(Region::inside(turned), {kite}, grid_at(degrees));
    }
}

TEST(Region, APolygonWithANotchMeetsWhereOneOfItsPartsDoes) {
  std::mt19937_64 random(test_seed(4));
  std::size_t only_bounds = 0;
  for (int n = 0; n < 50; ++n) {
    const Extent e = random_extent(random);
    const double x = e.xmin + 0.1 * (e.xmax - e.xmin), y = e.ymin + 0.1 * (e.ymax - e.ymin);
    const Region l = Region::inside(
        Corners{{e.xmin, e.ymin}, {e.xmax, e.ymin}, {e.xmax, y}, {x, y}, {x, e.ymax}, {e.xmin, e.ymax}});
    only_bounds += expect_meets(
        l, {corners({e.xmin, e.ymin, e.xmax, y}), corners({e.xmin, e.ymin, x, e.ymax})}, grid_at(12));
  }
  EXPECT_GT(only_bounds, 0u) << "negative control: the notch keeps some out";
}

// A star of many corners, whose sides lie in many slabs, against all of its sides one by one.
TEST(Region, APolygonOfManyCornersIsThatOfItsSides) {
  std::mt19937_64 random(test_seed(5));
  std::uniform_real_distribution<double> share(0, 1);
  for (const int n : {3, 40, 3000}) {
    Corners star;
    for (int k = 0; k < n; ++k) {
      const double r = 300 + 700 * share(random), a = 2 * M_PI * k / n;
      star.push_back({800 + r * std::cos(a), 600 + r * std::sin(a)});
    }
    const Region region = Region::inside(star);
    std::size_t in = 0;
    constexpr int kTries = 4000;
    for (int t = 0; t < kTries; ++t) {
      const Point p{-300 + 2200 * share(random), -500 + 2200 * share(random)};
      bool inside = false;
      for (std::size_t k = 0; k < star.size(); ++k) {
        const Point &a = star[k], &b = star[(k + 1) % star.size()];
        if ((a.y > p.y) != (b.y > p.y)) inside ^= p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y));
      }
      EXPECT_EQ(region.contains(p), inside) << n;
      in += inside;
    }
    EXPECT_GT(in, 0u);
    EXPECT_LT(in, std::size_t(kTries));
    // A block that holds a point of the polygon, or a corner, meets it.
    const Grid grid = grid_at(17);
    std::size_t met = 0;
    for (std::size_t k = 0; k < grid.info.shape.blocks(); ++k) {
      const GridShape::Block b = grid.info.shape.block(k);
      const Corners c = domain_of(grid, b);
      const LatticeRect d = grid.info.shape.domain(b.level, b.bx, b.by);
      bool must = std::any_of(c.begin(), c.end(), [&](Point p) { return region.contains(p); });
      for (const Point& p : star) {
        const Point at = grid.info.frame.to_lattice(p.x, p.y);
        must |= at.x > d.i0 && at.x < d.i1 && at.y > d.j0 && at.y < d.j1;
      }
      met += region.meets(grid, b);
      if (must) {
        EXPECT_TRUE(region.meets(grid, b)) << n;
      }
    }
    EXPECT_GT(met, 0u);
    EXPECT_LT(met, grid.info.shape.blocks());
  }
}

// As flat and as high as numbers go: places are found nonetheless.
TEST(Region, PolygonsOfExtremeHeightsHoldTheirPlaces) {
  const Region flat = Region::inside(Corners{{0, 0}, {10, 0}, {10, 1e-310}, {0, 1e-310}});
  EXPECT_TRUE(flat.contains({5, 5e-311}));
  EXPECT_FALSE(flat.contains({11, 5e-311}));
  const Region high = Region::inside(Corners{{0, -8e307}, {10, -8e307}, {10, 8e307}, {0, 8e307}});
  EXPECT_TRUE(high.contains({5, 0}));
  EXPECT_TRUE(high.contains({5, 7e307}));
  EXPECT_FALSE(high.contains({11, 0}));
}

TEST(Region, TextIsReadAsPairsOfCoordinates) {
  const Extent expected{0, -1.5, 20, 30};
  for (const char* text : {"0 -1.5, 20 0, 10 30", "POLYGON((0 -1.5, 20 0, 10 30, 0 -1.5))",
                           "POLYGON ((0 -1.5,20 0,10 3e1,0 -1.5))", " 0 -1.5 ,20 0 , 10 30 ",
                           "POLYGON Z ((0 -1.5 320, 20 0 300, 10 30 7, 0 -1.5 320))"}) {
    const Extent b = Region::parse_polygon(text).bounds();
    EXPECT_TRUE(b.xmin == expected.xmin && b.ymin == expected.ymin && b.xmax == expected.xmax &&
                b.ymax == expected.ymax)
        << text;
  }
}

TEST(Region, WhatIsNoRegionIsRefusedWithAReason) {
  for (const char* text :
       {"", "0 0, 1 1", "0 0, 1 0, 1 1, 5", "0 0, 1 0, 1 1 7", "0 0, 1 0, x 1", "0 0, 1 0, nan 1",
        "0 0, 1 0, 1 1 north", "POLYGON((0 0, 1 0, 1 1), (0 0, 1 0, 1 1))", "0 0, 1 0, 1e999 1",
        "0 0 1 0, 1 1 0 1, 2 2 3 3"})
    EXPECT_NE(refusal_of([&] { Region::parse_polygon(text); }), "") << text;
  EXPECT_NE(refusal_of([] { Region::inside(Corners{{0, 0}, {1, 0}}); }), "");
  EXPECT_NE(refusal_of([] { Region::inside(Corners{{0, 0}, {1, 0}, {NAN, 1}}); }), "");
  EXPECT_NE(refusal_of([] { Region::inside(Corners{{0, 0}, {1, 0}, {1, INFINITY}}); }), "");
  for (const Extent& e : {Extent{1, 0, 0, 1}, Extent{0, 1, 1, 0}, Extent{NAN, 0, 1, 1},
                          Extent{0, 0, INFINITY, 1}, Extent{0, -INFINITY, 1, 1}})
    EXPECT_NE(refusal_of([&] { Region::inside(e); }), "");
}

}  // namespace
}  // namespace patchwork
