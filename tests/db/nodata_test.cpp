// Holes on their way into a database: which cells are real, which answer, and what their outline costs.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "db/cell_masks.h"
#include "tests/db/databases.h"
#include "tests/grids.h"

namespace patchwork {
namespace {

constexpr int kWidth = 131, kHeight = 103;

double terrain(int i, int j) { return 100 + 30 * std::sin(0.1 * i) * std::cos(0.07 * j) + 0.01 * i * j; }

// Where samples are missing, by the name of the case.
const std::map<std::string, bool (*)(int, int)> kCases{
    {"a hole of one vertex", [](int i, int j) { return i == 60 && j == 40; }},
    {"a grid of holes", [](int i, int j) { return i % 9 == 4 && j % 7 == 3; }},
    {"a checkerboard of cells", [](int i, int j) { return (i % 4 < 2) == (j % 4 < 2); }},
    {"vertices alone but for one cell",
     [](int i, int j) { return (i + j) % 2 && !(i > 50 && i < 54 && j > 80 && j < 84); }},
    {"half of it", [](int i, int) { return i > kWidth / 2; }},
    {"all but the outermost cells",
     [](int i, int j) { return i > 1 && j > 1 && i < kWidth - 2 && j < kHeight - 2; }},
    {"all but the last column of cells", [](int i, int j) { return i < kWidth - 2 && j > 3; }},
    {"all but the last row of cells", [](int i, int j) { return j < kHeight - 2 && i > 3; }},
    {"one valid cell", [](int i, int j) { return !(i >= 70 && i <= 71 && j >= 50 && j <= 51); }},
};

GridFile with_holes(bool (*missing)(int, int), int width = kWidth, int height = kHeight) {
  GridFile file{.width = width, .height = height};
  file.at = [missing](int i, int j) { return missing(i, j) ? kHole : terrain(i, j); };
  return file;
}

struct Cells {
  bool real = true, answering = false;
};

// The cell (ci, cj) of a level from the samples themselves.
Cells cells_below(const GridFile& file, int level, int ci, int cj) {
  Cells c;
  for (int y = cj << level; y < std::min((cj + 1) << level, file.height - 1); ++y)
    for (int x = ci << level; x < std::min((ci + 1) << level, file.width - 1); ++x) {
      const double sum = file.at(x, y) + file.at(x + 1, y) + file.at(x, y + 1) + file.at(x + 1, y + 1);
      c.real &= !std::isnan(sum), c.answering |= !std::isnan(sum);
    }
  return c;
}

// Compares what the patch that speaks for a cell says of it with the samples.
void check_cell(const Database& db, const Grid& g, const GridFile& file, int level, int ci, int cj) {
  const GridShape& shape = g.info.shape;
  const int bx = std::min(ci / kKernelCells, shape.blocks_i(level) - 1);
  const int by = std::min(cj / kKernelCells, shape.blocks_j(level) - 1);
  const Cells expected = cells_below(file, level, ci, cj);
  const PatchRecord& p = g.at(level, bx, by);
  if (!p.exists()) {
    EXPECT_FALSE(expected.answering) << "level " << level << " cell " << ci << ", " << cj << " has no patch";
    return;
  }
  const auto s = db.surface(PatchId::make(g.info.id, level, bx, by));
  EXPECT_EQ(p.ragged(), s->holes != nullptr);
  const auto k = size_t((cj - int(s->first_j)) * PatchSurface::kSide + ci - int(s->first_i));
  EXPECT_EQ(s->holes ? s->holes->real[k] : 1, expected.real) << level << ": " << ci << ", " << cj;
  EXPECT_EQ(s->holes ? s->holes->answering[k] : 1, expected.answering) << level << ": " << ci << ", " << cj;
  if (expected.answering && !expected.real) {
    for (const double e : p.error) EXPECT_GE(e, std::hypot(10, 10) * (1 << level)) << "the outline of a hole";
  }
}

TEST(NodataEdges, EveryCellOfEveryLevelSaysWhatItsSamplesSay) {
  for (const auto& [name, missing] : kCases) {
    SCOPED_TRACE(name);
    const GridFolder folder;
    const GridFile file = with_holes(missing);
    Database db = folder.database();
    ASSERT_EQ(refusal_of([&] { folder.add(db, file, "grid"); }), "");
    const Grid& g = db.grids()[0];
    for (int l = 0; l < g.info.shape.levels(); ++l)
      for (int cj = 0; cj + 1 < g.info.shape.lattice_rows(l); ++cj)
        for (int ci = 0; ci + 1 < g.info.shape.lattice_cols(l); ++ci) check_cell(db, g, file, l, ci, cj);
  }
}

TEST(NodataEdges, ValidSamplesAreStoredAsTheyAreAndNoneLeaksIn) {
  for (const auto& [name, missing] : kCases)
    for (const double nodata : {-9999.0, -32768.0, 3e38}) {
      SCOPED_TRACE(name);
      const GridFolder folder;
      GridFile file = with_holes(missing, 70, 65);
      file.nodata = nodata, file.accuracy = 0;
      if (name == std::string("one valid cell") || name == std::string("vertices alone but for one cell"))
        continue;
      Database db = folder.database();
      folder.add(db, file, "grid");
      const Grid& g = db.grids()[0];
      each_patch(g, [&](std::size_t k, GridShape::Block b) {
        const auto s = db.surface(g.patch_id(k));
        for (int v = 0; v < PatchSurface::kSide; ++v)
          for (int u = 0; u < PatchSurface::kSide; ++u) {
            const int i = (int(s->first_i) + u) * (1 << b.level), j = (int(s->first_j) + v) * (1 << b.level);
            if (i < 0 || j < 0 || i >= file.width || j >= file.height) continue;
            const double h = g.info.height(s->codes[size_t(v * PatchSurface::kSide + u)]);
            if (b.level == 0 && !std::isnan(file.at(i, j))) {
              EXPECT_NEAR(h, float(terrain(i, j)), g.info.quantisation) << i << ", " << j;
            }
            EXPECT_LT(std::abs(h), 1000) << b.level << " at " << i << ", " << j;
          }
      });
    }
}

TEST(NodataEdges, InfinitiesAndNaNAreHolesToo) {
  for (const double hole : {double(INFINITY), double(-INFINITY), double(NAN)}) {
    const GridFolder folder;
    GridFile file{.width = 50, .height = 50};
    file.at = [hole](int i, int j) { return i == 20 && j == 20 ? hole : terrain(i, j); };
    Database db = folder.database();
    folder.add(db, file, "grid");
    EXPECT_TRUE(db.grids()[0].info.holes);
    check_cell(db, db.grids()[0], file, 0, 25, 25);
    const auto s = db.surface(PatchId::make(db.grids()[0].info.id, 0, 0, 0));
    ASSERT_TRUE(s->holes);
    EXPECT_FALSE(s->holes->answering[size_t((20 + 3) * PatchSurface::kSide + 20 + 3)]);
  }
}

TEST(NodataEdges, AGridWithoutHolesHasNoMasksAndPaysForNoOutline) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, with_holes([](int, int) { return false; }), "whole");
  folder.add(db, with_holes(kCases.at("a hole of one vertex")), "holed");
  const Grid &whole = grid_named(db, "whole"), &holed = grid_named(db, "holed");
  EXPECT_FALSE(whole.info.holes);
  EXPECT_TRUE(holed.info.holes);
  int dearer = 0;
  each_patch(whole, [&](std::size_t k, GridShape::Block b) {
    EXPECT_FALSE(whole.patches[k].ragged());
    dearer += b.level > 0 && holed.patches[k].bottom > whole.patches[k].bottom;
  });
  EXPECT_GT(dearer, 0) << "negative control: with one hole some coarse patches cost its outline";
}

TEST(NodataEdges, WithoutOneWholeCellTheFileIsRefused) {
  const GridFolder folder;
  Database db = folder.database();
  const auto refused = [&](const GridFile& file) {
    return refusal_of([&] { folder.add(db, file, "grid"); });
  };
  EXPECT_NE(refused(with_holes([](int, int) { return true; })).find("every sample is nodata"),
            std::string::npos);
  EXPECT_NE(refused(with_holes([](int i, int j) { return (i + j) % 2 != 0; })).find("no cell with data"),
            std::string::npos);
  EXPECT_NE(refused(heights("1 x / 2 3")).find("no cell with data"), std::string::npos);
  EXPECT_NE(refused(heights("1 x 4 / x 3 x / 4 4 x")).find("no cell with data"), std::string::npos);
  EXPECT_EQ(db.grids().size(), 0u);
  EXPECT_EQ(refused(heights("1 x 4 / 3 3 x / 4 4 x")), "");
}

TEST(CellMasks, NestAndFollowTheirDefinition) {
  const GridFile file = with_holes(kCases.at("a grid of holes"));
  const GridShape shape(kWidth, kHeight, true);
  std::vector<std::uint8_t> level0;
  for (int j = 0; j + 1 < kHeight; ++j)
    for (int i = 0; i + 1 < kWidth; ++i) level0.push_back(cells_below(file, 0, i, j).real);
  const CellMasks masks = CellMasks::from_cells(level0, shape);
  for (int l = 0; l < shape.levels(); ++l)
    for (int j = 0; j < masks.rows(l); ++j)
      for (int i = 0; i < masks.cols(l); ++i) {
        const Cells c = cells_below(file, l, i, j);
        ASSERT_EQ(masks.at(l, i, j) & ~CellMasks::kOutside,
                  (c.real ? CellMasks::kReal : 0) | (c.answering ? CellMasks::kAnswering : 0));
        if (l > 0) continue;
        EXPECT_TRUE(c.real == c.answering) << "at level 0 the outline is exact";
      }
}

TEST(CellMasks, OutsideIsWhatIsJoinedToTheBorderWithoutData) {
  // Level-0 cells of a 9 x 6 grid: a bay that is open to the left, a lake, a pond that touches the bay by a
  // corner.
  const std::vector<std::string> map{"11111111", "00111001", "10111001", "11011111", "11111111"};
  std::vector<std::uint8_t> cells;
  for (const std::string& row : map)
    for (const char c : row) cells.push_back(c == '1');
  const CellMasks masks = CellMasks::from_cells(cells, GridShape(9, 6, false));
  const auto outside = [&](int i, int j) { return (masks.at(0, i, j) & CellMasks::kOutside) != 0; };
  EXPECT_TRUE(outside(0, 1) && outside(1, 1) && outside(1, 2)) << "the bay";
  EXPECT_FALSE(outside(5, 1) || outside(6, 2)) << "the lake";
  EXPECT_FALSE(outside(2, 3)) << "the pond";
  EXPECT_FALSE(outside(0, 0)) << "the land";
}

}  // namespace
}  // namespace patchwork
