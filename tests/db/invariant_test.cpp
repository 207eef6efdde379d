// Tops and best flags against the model's formulas, evaluated word by word with every patch as a candidate.
#include "db/invariant.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tests/db/databases.h"
#include "tests/db/model.h"
#include "tests/grids.h"
#include "tests/hard_case.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

double rough(double x, double y) {
  return 40 * std::sin(x / 170) * std::cos(y / 130) + 5 * std::sin(x / 21 + y / 37) +
         0.3 * std::sin(x * 1.7 + y);
}

// A few small grids at any angle over each other, some with holes.
Database scene(const GridFolder& folder, std::mt19937_64& random, int grids) {
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  Database db = folder.database();
  for (int n = 0; n < grids; ++n) {
    GridFile file{.width = 40 + int(random() % 60), .height = 40 + int(random() % 50)};
    const double step = uniform(4, 12);
    file.geotransform =
        rotated(uniform(-200, 200), uniform(500, 900), n % 2 ? uniform(-40, 40) : 0, step, step);
    file.accuracy = uniform(0.05, 3);
    file.pixel_is_area = random() % 2;
    file = of_terrain(file, rough);
    if (n % 3 == 1)
      file.at = [at = file.at, w = file.width](int i, int j) {
        return i < w / 3 && j > 12 ? kHole : at(i, j);
      };
    folder.add(db, file, fmt::format("g{}", n));
  }
  return db;
}

TEST(Invariant, AgreesWithTheFormulasOfTheModel) {
  std::mt19937_64 random(test_seed(1));
  int finite = 0, dormant = 0, not_best = 0, other_without_order = 0;
  for (int round = 0; round < 6; ++round) {
    const GridFolder folder;
    const Database db = scene(folder, random, 5);
    for (std::size_t g = 0; g < db.grids().size(); ++g)
      each_patch(db.grids()[g], [&](std::size_t k, GridShape::Block b) {
        const PatchRecord& p = db.grids()[g].patches[k];
        EXPECT_EQ(p.top, model::top(db.grids(), {g, k}))
            << g << ": " << b.level << ", " << b.bx << ", " << b.by;
        EXPECT_EQ(p.best(), model::best(db.grids(), {g, k}))
            << g << ": " << b.level << ", " << b.bx << ", " << b.by;
        finite += p.top < model::kInfinity, dormant += p.dormant(), not_best += !p.best();
        other_without_order += p.top != model::top(db.grids(), {g, k}, false);
      });
  }
  EXPECT_GT(finite, 0);
  EXPECT_GT(dormant, 0);
  EXPECT_GT(not_best, 0);
  EXPECT_GT(other_without_order, 0) << "negative control: without the order test tops differ";
}

// Does a patch answer at a point of the lattice? `hairline`: the point is too near to its rim to say.
bool answers(const Database& db, const Grid& g, std::size_t k, Point at, bool& hairline) {
  const GridShape::Block b = g.info.shape.block(k);
  const LatticeRect r = g.info.shape.kernel(b.level, b.bx, b.by), outer = model::grown(r, b.level);
  const auto in = [&](const LatticeRect& q) {
    return at.x >= q.i0 && at.x <= q.i1 && at.y >= q.j0 && at.y <= q.j1;
  };
  hairline |= in(outer) != in(r);
  if (!in(r) || !g.patches[k].ragged()) return in(r);
  const auto s = db.surface(g.patch_id(k));
  const int u = int(std::floor(std::ldexp(at.x, -b.level) - s->first_i));
  const int v = int(std::floor(std::ldexp(at.y, -b.level) - s->first_j));
  return s->holes->answering[size_t(v * PatchSurface::kSide + u)];
}

// The theorem of the model: at any point and error the greatest patch that answers is live.
TEST(Invariant, TheGreatestPatchThatAnswersAtAPointIsLive) {
  std::mt19937_64 random(test_seed(2));
  const GridFolder folder;
  const Database db = scene(folder, random, 6);
  CoverageCounts counts;
  int answered = 0, smaller_dead = 0;
  for (int n = 0; n < 20000; ++n) {
    const double x = std::uniform_real_distribution<double>(-300, 900)(random);
    const double y = std::uniform_real_distribution<double>(-300, 900)(random);
    const double z = std::exp(std::uniform_real_distribution<double>(-3, 4)(random));
    const Grid* greatest = nullptr;
    std::size_t index = 0;
    bool hairline = false;
    for (const Grid& g : db.grids())
      each_patch(g, [&](std::size_t k, auto) {
        if (g.patches[k].bottom > z || !answers(db, g, k, g.info.frame.to_lattice(x, y), hairline)) return;
        smaller_dead += g.patches[k].top <= z;
        if (!greatest || less(*greatest, index, g, k, counts)) greatest = &g, index = k;
      });
    if (!greatest || hairline) continue;
    ++answered;
    EXPECT_GT(greatest->patches[index].top, z) << x << ", " << y;
  }
  EXPECT_GT(answered, 1000);
  EXPECT_GT(smaller_dead, 1000) << "negative control: other patches that answer are not live";
}

TEST(Invariant, TheOrderOfPatchesIsStrictAndTotal) {
  std::mt19937_64 random(test_seed(3));
  const GridFolder folder;
  Database db = scene(folder, random, 4);
  // The frame of g0 again, with other heights: equal areas, and with equal bottoms the content decides.
  folder.add(db, heights("1 1 1 / 1 1 1 / 1 1 1"), "flat");
  folder.add(db, heights("2 2 2 / 2 2 2 / 2 2 2"), "also flat");
  std::vector<std::pair<const Grid*, std::size_t>> all;
  for (const Grid& g : db.grids()) each_patch(g, [&](std::size_t k, auto) { all.emplace_back(&g, k); });
  CoverageCounts counts;
  const auto before = [&](const auto& a, const auto& b) {
    return less(*a.first, a.second, *b.first, b.second, counts);
  };
  std::vector<std::size_t> rank;
  for (const auto& a : all) {
    EXPECT_FALSE(before(a, a));
    std::size_t smaller = 0;
    for (const auto& b : all) {
      smaller += before(b, a);
      if (&a != &b) {
        EXPECT_NE(before(a, b), before(b, a));
      }
    }
    rank.push_back(smaller);
  }
  EXPECT_EQ(std::set<std::size_t>(rank.begin(), rank.end()).size(), all.size()) << "ranks are a permutation";
}

TEST(Invariant, RedundantPatchesAreKeptDormantAndLeaveTheTree) {
  const GridFolder folder;
  Database db = folder.database();
  GridFile file = of_terrain({.width = 120,
                              .height = 100,
                              .geotransform = rotated(0, 0, 20, 5, 5),
                              .type = GDT_Int16,
                              .accuracy = 4},
                             rough);
  const ImportReport first = folder.add(db, file, "old");
  EXPECT_EQ(first.hidden, 0u);
  const std::size_t live_before = count_live(db);
  file.accuracy = 0.5;  // the same ground, better known
  const ImportReport second = folder.add(db, file, "new");
  const Grid& old = grid_named(db, "old");
  std::size_t dormant = 0;
  each_patch(old, [&](std::size_t k, auto) {
    dormant += old.patches[k].dormant();
    EXPECT_EQ(db.surface(old.patch_id(k))->codes, db.surface(grid_named(db, "new").patch_id(k))->codes);
  });
  EXPECT_EQ(dormant, old.patches.size()) << "all of the old survey is redundant";
  EXPECT_EQ(second.hidden, live_before) << "and what was live is reported as hidden";
  EXPECT_EQ(db.tree().size(), count_live(db));
  std::size_t in_tree = 0;
  db.tree().traverse([](const LodBox&) { return true; },
                     [&](const LodTree::Entry& e) { in_tree += !db.patch(e.id).dormant(); });
  EXPECT_EQ(in_tree, count_live(db)) << "the tree holds the live patches and no other";
  EXPECT_EQ(db.tree().find_violation(), "");
}

// A flat square of `side` samples: vertex (0, 0) at (i, j) of a lattice with these axes (metres) that begins
// 1e7 m from the origin, its steps `part` of that lattice's. All numbers are dyadic: nothing is rounded.
GridFile flat_square(const std::array<double, 4>& axes, int side, double i, double j, double part,
                     double accuracy) {
  const double x = 1e7 + axes[0] * (i - part / 2) + axes[1] * (j - part / 2);
  const double y = -1e7 + axes[2] * (i - part / 2) + axes[3] * (j - part / 2);
  return {.width = side,
          .height = side,
          .geotransform = {x, part * axes[0], part * axes[1], y, part * axes[2], part * axes[3]},
          .accuracy = accuracy,
          .at = [](int, int) { return 7.0; }};
}

// A worse survey across the seam of two better ones, whose kernels end `gap` of their own cells before each
// other. Both are grown by 1/1024 of their cell, so 1/512 is the widest gap that is none.
TEST(CoverageSliver, KernelsOfTwoSurveysGrowByAPartOfTheirOwnCells) {
  struct Case {
    std::array<double, 4> axes;
    int side, level;  // level: of the one block that covers
  };
  std::uint64_t tries = 0;
  for (const auto& [axes, side, level] : {Case{{30, 0, 0, -30}, 36, 0}, Case{{24, 18, 18, -24}, 45, 1}}) {
    const GridFolder folder;
    Database db = folder.database();
    const GridShape shape(side, side, true);
    const LatticeRect core = shape.core();
    ASSERT_EQ(shape.levels(), level + 1);
    folder.add(db, flat_square(axes, side, 0, 0, 1, 0.1), "west");
    // Its kernel [7.5, 27.5] is 20/8 of these cells wide; the seam is its middle.
    folder.add(db, flat_square(axes, 36, core.i1 - 17.5 / 8, 14, 0.125, 5), "target");
    int open = 0;
    for (const auto& [gap, closed] :
         {std::pair{1.0 / 2048, true}, {1.0 / 512, true}, {1.0 / 512 + 0x1p-20, false}, {1.0 / 256, false}}) {
      folder.add(db, flat_square(axes, side, core.i1 - core.i0 + std::ldexp(gap, level), 0, 1, 0.1), "east");
      const Grid &west = grid_named(db, "west"), &east = grid_named(db, "east"),
                 &target = grid_named(db, "target");
      const PatchRecord p = target.patches[0];
      const double bottom = west.at(level, 0, 0).bottom;
      EXPECT_EQ(p.top, closed ? bottom : model::kInfinity) << "level " << level << " gap " << gap;
      EXPECT_EQ(p.dormant(), closed) << "level " << level << " gap " << gap;
      EXPECT_EQ(p.best(), !closed) << "level " << level << " gap " << gap;
      const std::vector<OrientedRect> plain{{&west.info.frame, shape.kernel(level, 0, 0)},
                                            {&east.info.frame, shape.kernel(level, 0, 0)}};
      CoverageCounts counts;
      open += !covered({&target.info.frame, target.info.shape.kernel(0, 0, 0)}, plain, counts);
      ++tries;
      db.remove("east");
      EXPECT_FALSE(grid_named(db, "target").patches[0].dormant()) << "one half alone";
    }
    EXPECT_EQ(open, 4) << "negative control: without growth every gap is one";
  }
  report_law("CoverageSliver", "seams of two surveys in a database, 1e7 m from the origin", tries);
}

}  // namespace
}  // namespace patchwork
