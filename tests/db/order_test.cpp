// Grids in any order make one database, and equal ones are there once.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "db/database.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/hard_case.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

// --- OrderPermutations.

// Overlapping surveys, rotated, some with holes, two of equal frame and one constant.
std::vector<GridFile> overlapping(int n, int side, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::vector<GridFile> files;
  for (int k = 0; k < n; ++k) {
    GridFile file{.width = side + int(random() % 12), .height = side + int(random() % 12)};
    const double step = uniform(5, 9);
    file.geotransform = k == 1 ? files[0].geotransform
                               : rotated(uniform(-90, 90), uniform(-90, 90), uniform(-180, 180), step, step);
    if (k == 1) file.width = files[0].width, file.height = files[0].height;
    file.accuracy = k < 2 ? 1 : uniform(0.2, 3);
    const double lift = k;
    file = of_terrain(file, [lift](double x, double y) { return rough_terrain(x, y) + lift; });
    if (k % 3 == 2)
      file.at = [at = file.at, side](int i, int j) {
        return i > side / 2 && j > side / 2 ? kHole : at(i, j);
      };
    if (k == 3) file.at = [](int, int) { return 7.0; };
    files.push_back(file);
  }
  return files;
}

class Orders {
 public:
  explicit Orders(const std::vector<GridFile>& files) {
    for (std::size_t k = 0; k < files.size(); ++k)
      sources_.push_back(folder_.source(files[k], fmt::format("g{}", k)));
  }
  std::string hash(const std::vector<std::size_t>& order) {
    const std::string name = fmt::format("d{}", count_++);
    Database db = folder_.database(name);
    for (const std::size_t k : order) db.import(sources_[k], {.name = fmt::format("g{}", k)});
    EXPECT_EQ(db.tree().size(), count_live(db));
    return db.content_hash();
  }
  std::string replaced(const GridFile& other, std::size_t k) {
    sources_[k] = folder_.source(other, "other");
    std::vector<std::size_t> order(sources_.size());
    std::iota(order.begin(), order.end(), 0);
    return hash(order);
  }

 private:
  GridFolder folder_;
  std::vector<RasterSource> sources_;
  int count_ = 0;
};

// PATCHWORK_TRIALS=200 tries as many shuffles as the design asks for.
int shuffles() { return test_trials(8); }

// All 720 orders of six grids, a test for each grid that may come first.
class OrderPermutations : public testing::TestWithParam<int> {};

TEST_P(OrderPermutations, OfSixOverlappingGridsGiveOneHash) {
  const std::vector<GridFile> files = overlapping(6, 20, test_seed(1));
  Orders orders(files);
  std::vector<std::size_t> order(files.size());
  std::iota(order.begin(), order.end(), 0);
  const std::string expected = orders.hash(order);
  std::rotate(order.begin(), order.begin() + GetParam(), order.begin() + GetParam() + 1);
  int tried = 0;
  do {
    ASSERT_EQ(orders.hash(order), expected) << testing::PrintToString(order);
    ++tried;
  } while (std::next_permutation(order.begin() + 1, order.end()));
  EXPECT_EQ(tried, 120);
  GridFile other = files[2];
  other.at = [at = other.at](int i, int j) { return at(i, j) + (i == 3 && j == 4); };
  EXPECT_NE(orders.replaced(other, 2), expected) << "negative control: one other sample";
  report_law("OrderPermutations", "orders of six overlapping grids", std::uint64_t(tried));
}

INSTANTIATE_TEST_SUITE_P(First, OrderPermutations, testing::Range(0, 6));

TEST(OrderPermutations, ShufflesOfFortyGridsGiveOneHash) {
  const std::uint64_t seed = test_seed(2);
  Orders orders(overlapping(40, 34, seed));
  std::vector<std::size_t> order(40);
  std::iota(order.begin(), order.end(), 0);
  const std::string expected = orders.hash(order);
  std::mt19937_64 random(seed);
  for (int n = 0; n < shuffles(); ++n) {
    std::shuffle(order.begin(), order.end(), random);
    ASSERT_EQ(orders.hash(order), expected) << testing::PrintToString(order);
  }
  report_law("OrderPermutations", "shuffles of forty grids", std::uint64_t(shuffles()));
}

// --- EqualGrids.

TEST(EqualGrids, TheSameGridTwiceIsThereOnce) {
  const GridFolder folder;
  Database db = folder.database();
  const GridFile file = of_terrain({.width = 60, .height = 50}, rough_terrain);
  folder.add(db, file, "first");
  const std::string hash = db.content_hash();
  const ImportReport report = folder.add(db, file, "second");
  EXPECT_EQ(report.duplicate_of, "first");
  EXPECT_EQ(report.patches, 0u);
  EXPECT_EQ(db.grids().size(), 1u);
  EXPECT_EQ(db.content_hash(), hash);
  EXPECT_EQ(Database::open(db.path()).content_hash(), hash);
  EXPECT_EQ(folder.add(db, of_terrain({.width = 60, .height = 50, .accuracy = 0.2}, rough_terrain), "third")
                .duplicate_of,
            "")
      << "negative control: another accuracy is another grid";
}

TEST(EqualGrids, EqualFramesWithOtherHeightsHaveOneWinnerWhateverTheOrder) {
  const GridFile low{.width = 60, .height = 50, .at = [](int, int) { return 10.0; }};
  const GridFile high{.width = 60, .height = 50, .at = [](int, int) { return 20.0; }};
  std::vector<std::string> winners, hashes;
  for (const bool swapped : {false, true}) {
    const GridFolder folder;
    Database db = folder.database();
    folder.add(db, swapped ? high : low, swapped ? "high" : "low");
    folder.add(db, swapped ? low : high, swapped ? "low" : "high");
    std::string live;
    for (const Grid& g : db.grids())
      each_patch(g, [&](std::size_t k, auto) { live += g.patches[k].dormant() ? "" : g.info.name; });
    winners.push_back(live), hashes.push_back(db.content_hash());
  }
  EXPECT_TRUE(winners[0] == "low" || winners[0] == "high") << winners[0];
  EXPECT_EQ(winners[0], winners[1]);
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(EqualGrids, ANameIsGivenOnce) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, heights("1 2 / 3 4"), "name");
  EXPECT_NE(refusal_of([&] { folder.add(db, heights("1 2 / 3 5"), "name"); }).find("has a grid named name"),
            std::string::npos);
}

}  // namespace
}  // namespace patchwork
