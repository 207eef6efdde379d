#include "db/lod_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <random>

#include "db/error.h"

namespace patchwork {
namespace {

using Entry = LodTree::Entry;
using Pages = std::map<std::uint32_t, std::vector<std::byte>>;

constexpr float kForever = std::numeric_limits<float>::infinity();
constexpr Extent kEverywhere{-1e9, -1e9, 1e9, 1e9};

std::uint32_t seed() {
  const char* given = std::getenv("PATCHWORK_SEED");
  const auto s = given ? std::uint32_t(std::strtoul(given, nullptr, 10)) : 20240608u;
  std::cout << "PATCHWORK_SEED=" << s << '\n';
  return s;
}

// Boxes as a pyramid has them: small where fine; some best available (bottom 0), some never hidden (top
// infinite), some flat, some without height.
class Boxes {
 public:
  explicit Boxes(std::uint32_t s) : random_(s) {}

  Entry next() {
    const double side = std::exp2(uniform(0, 9)), x = uniform(-1000, 1000), y = uniform(5e6, 5e6 + 2000);
    const auto error = float(side * uniform(0.01, 0.1));
    LodBox box{x, y, x + side, y + side * uniform(0.5, 1), error, error * float(uniform(1, 4))};
    const unsigned kind = random_() % 16;
    if (kind < 4) box.bottom = 0;
    if (kind % 4 == 0) box.top = kForever;
    if (kind == 5) box.xmax = box.xmin;
    if (kind == 6) box.top = box.bottom;
    return {box, {ids_++}};
  }
  std::vector<Entry> take(std::size_t n) {
    std::vector<Entry> entries;
    std::generate_n(std::back_inserter(entries), n, [&] { return next(); });
    return entries;
  }
  Extent region() {
    const double x = uniform(-1200, 1200), y = uniform(5e6 - 200, 5e6 + 2200),
                 side = std::exp2(uniform(-3, 11));
    return {x, y, x + side, y + side};
  }
  double error() { return random_() % 8 == 0 ? 0 : std::exp2(uniform(-8, 8)); }
  std::size_t below(std::size_t n) { return random_() % n; }

 private:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  std::mt19937 random_;
  std::uint64_t ids_ = 0;
};

std::vector<std::uint64_t> sorted(std::vector<std::uint64_t> ids) {
  std::sort(ids.begin(), ids.end());
  return ids;
}

bool hit(const LodBox& b, const Extent& r, double error) {
  return b.xmin <= r.xmax && r.xmin <= b.xmax && b.ymin <= r.ymax && r.ymin <= b.ymax &&
         double(b.bottom) <= error && error < double(b.top);
}

std::vector<std::uint64_t> scan(const std::vector<Entry>& all, const Extent& region, double error) {
  std::vector<std::uint64_t> ids;
  for (const Entry& e : all)
    if (hit(e.box, region, error)) ids.push_back(e.id.value);
  return sorted(ids);
}

std::vector<std::uint64_t> visit(const LodTree& tree, const Extent& region, double error) {
  std::vector<std::uint64_t> ids;
  tree.visit_uniform(region, error, [&](const Entry& e) { ids.push_back(e.id.value); });
  return sorted(ids);
}

std::vector<std::uint64_t> traverse(const LodTree& tree, const Extent& region, double error) {
  std::vector<std::uint64_t> ids;
  tree.traverse([&](const LodBox& b) { return hit(b, region, error); },
                [&](const Entry& e) { ids.push_back(e.id.value); });
  return sorted(ids);
}

void expect_agrees(const LodTree& tree, const std::vector<Entry>& all, Boxes& boxes, int queries) {
  ASSERT_EQ(tree.find_violation(), "");
  ASSERT_EQ(tree.size(), all.size());
  std::size_t found = 0;
  for (int i = 0; i < queries; ++i) {
    const Extent region = boxes.region();
    const double error = boxes.error();
    const std::vector<std::uint64_t> expected = scan(all, region, error);
    found += expected.size();
    ASSERT_EQ(visit(tree, region, error), expected);
    ASSERT_EQ(traverse(tree, region, error), expected);
  }
  EXPECT_TRUE(found > 0 || all.size() < 500) << "nothing was compared";
}

// 10^4 changes: removals of what is there, insertions of what is new.
void change(LodTree& tree, std::vector<Entry>& all, Boxes& boxes, int changes, std::size_t removals_of_16) {
  for (int i = 0; i < changes; ++i) {
    if (!all.empty() && boxes.below(16) < removals_of_16) {
      std::swap(all[boxes.below(all.size())], all.back());
      ASSERT_TRUE(tree.erase(all.back()));
      all.pop_back();
    } else {
      all.push_back(boxes.next());
      tree.insert(all.back());
    }
    if (i % 500 == 0) {
      ASSERT_EQ(tree.find_violation(), "");
    }
  }
}

Pages pages_of(LodTree& tree) {
  Pages pages;
  for (const std::uint32_t p : tree.take_dirty_pages()) pages[p] = tree.page_bytes(p);
  return pages;
}

LodTree reopened(const std::vector<std::byte>& header, const Pages& pages) {
  return LodTree::open(header, [pages](std::uint32_t index) {
    const auto page = pages.find(index);
    if (page == pages.end()) throw Error("test", "no such page");
    return page->second;
  });
}

std::string refusal(const std::vector<std::byte>& header, const Pages& pages) {
  try {
    const std::string violation = reopened(header, pages).find_violation();
    return violation.empty() ? violation : "R-tree: " + violation;
  } catch (const Error& e) {
    return e.what();
  }
}

TEST(LodTree, AgreesWithScanningEveryBoxAfterBuildingInBulk) {
  Boxes boxes(seed());
  for (const std::size_t n : {0, 1, 2, 59, 60, 61, 64, 65, 121, 1000, 3601, 20000}) {
    const std::vector<Entry> all = boxes.take(n);
    expect_agrees(LodTree::build(all), all, boxes, 200);
  }
}

TEST(LodTree, AgreesWithScanningEveryBoxWhileItGrowsAndShrinks) {
  Boxes boxes(seed());
  for (const std::size_t start : {0, 5000}) {
    std::vector<Entry> all = boxes.take(start);
    LodTree tree = LodTree::build(all);
    for (const std::size_t removals : {4, 8, 13}) {
      change(tree, all, boxes, 10000, removals);
      expect_agrees(tree, all, boxes, 200);
    }
    while (!all.empty()) change(tree, all, boxes, 500, 16);
    expect_agrees(tree, all, boxes, 10);
  }
}

TEST(LodTree, AgreesWithScanningEveryBoxWhenAllAreTheSame) {
  Boxes boxes(seed());
  const Entry one{{1, 5e6, 2, 5e6 + 1, 0, kForever}, {7}};
  LodTree tree;
  std::vector<Entry> all(1000, one);
  for (const Entry& e : all) tree.insert(e);
  ASSERT_EQ(tree.find_violation(), "");
  EXPECT_EQ(visit(tree, kEverywhere, 1), scan(all, kEverywhere, 1));
  EXPECT_EQ(visit(LodTree::build(all), kEverywhere, 1), scan(all, kEverywhere, 1));
  for (const Entry& e : all) ASSERT_TRUE(tree.erase(e));
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_FALSE(tree.erase(one));
}

VisitCost cost_of(const LodTree& tree, Boxes boxes) {
  VisitCost sum;
  for (int i = 0; i < 500; ++i) {
    const Extent region = boxes.region();
    const VisitCost c = tree.visit_uniform(region, boxes.error(), [](const Entry&) {});
    sum.nodes += c.nodes, sum.boxes += c.boxes;
  }
  return sum;
}

TEST(LodTree, TenThousandChangesKeepItAlmostAsTightAsBuiltAnew) {
  Boxes boxes(seed());
  std::vector<Entry> all = boxes.take(30000);
  LodTree tree = LodTree::build(all);
  change(tree, all, boxes, 10000, 8);
  const VisitCost changed = cost_of(tree, boxes), anew = cost_of(LodTree::build(all), boxes);
  EXPECT_LE(double(changed.nodes), 1.3 * double(anew.nodes));
  EXPECT_LE(double(changed.boxes), 1.3 * double(anew.boxes));
  EXPECT_GT(tree.shape().fill, 0.6);
}

TEST(LodTree, HitsAreClosedInPlaceAndHalfOpenInError) {
  LodTree tree;
  tree.insert({{0, 0, 1, 1, 0.1f, 0.2f}, {1}});
  const auto hits = [&](const Extent& r, double e) { return visit(tree, r, e).size(); };
  EXPECT_EQ(hits({1, 1, 2, 2}, 0.15), 1u);
  EXPECT_EQ(hits({std::nextafter(1, 2), 1, 2, 2}, 0.15), 0u);
  EXPECT_EQ(hits(kEverywhere, double(0.1f)), 1u);
  EXPECT_EQ(hits(kEverywhere, std::nextafter(double(0.1f), 0)), 0u);  // would round to the float 0.1
  EXPECT_EQ(hits(kEverywhere, double(0.2f)), 0u);
  EXPECT_EQ(hits(kEverywhere, std::nextafter(double(0.2f), 0)), 1u);
  EXPECT_EQ(hits(kEverywhere, std::numeric_limits<double>::quiet_NaN()), 0u);
}

// What views compare instead of a page's sides: never inside them, and close to them.
TEST(LodPage, FloatsFromTheOriginHoldTheBoxes) {
  std::mt19937_64 random(seed());
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  double furthest = 0;
  for (const double away : {0.0, 4.2e6, -1e12}) {
    LodPage page(0);
    const auto box = [&] {
      const double x = away + uniform(-500, 500), y = 2 * away + uniform(-500, 500);
      return LodBox{x, y, x + uniform(0, 90), y + uniform(0, 90), 1, 2};
    };
    for (int n = 0; n < 2000; ++n) {
      const std::uint32_t slot = page.count ? std::uint32_t(random() % page.count) : 0;
      if (page.count == 0 || (page.count < LodPage::kSlots && n % 3 == 0))
        page.append({box(), {std::uint64_t(n)}});
      else if (n % 3 == 1)
        page.set_box(slot, box());
      else if (n % 50 == 2)
        page.remove(slot);
      for (std::uint32_t s = 0; s < page.count; ++s) {
        const LodBox b = page.box(s);
        const double lost = page.reach * 0x1p-53;
        const double out[] = {b.xmin - page.origin.x - double(page.west[s]),
                              b.ymin - page.origin.y - double(page.south[s]),
                              double(page.east[s]) - (b.xmax - page.origin.x),
                              double(page.north[s]) - (b.ymax - page.origin.y)};
        for (const double o : out) {
          ASSERT_GE(o, -lost);
          furthest = std::max(furthest, o / page.reach);
        }
        ASSERT_LE(std::max(std::abs(b.xmin - page.origin.x), std::abs(b.ymax - page.origin.y)), page.reach);
      }
    }
  }
  LodPage page(0);
  for (const double x : {0.0, 1e9}) page.append({{x, 0, x + 1, 1, 1, 2}, {1}});
  page.remove(0), page.remove(0);
  page.append({{0, 0, 1, 1, 1, 2}, {1}});
  EXPECT_EQ(page.reach, 1) << "what was emptied begins anew";
  EXPECT_LT(furthest, 0x1p-23);
  EXPECT_GT(furthest, 0) << "negative control: floats do lose something";
}

TEST(LodTree, ErasesOnlyWhatIsEqual) {
  Boxes boxes(seed());
  const std::vector<Entry> all = boxes.take(300);
  LodTree tree = LodTree::build(all);
  Entry other = all[100];
  other.id.value += 1000;
  EXPECT_FALSE(tree.erase(other));
  other = all[100];
  other.box.xmax += 1;
  EXPECT_FALSE(tree.erase(other));
  expect_agrees(tree, all, boxes, 10);
}

TEST(LodTree, BuildHoldsBoxesWhoseAreasAreNoNumbers) {
  std::vector<LodTree::Entry> entries;
  for (std::uint64_t k = 0; k < 1000; ++k) {
    const double x = (k % 2 ? 1e200 : -1e200) * double(1 + k % 7);
    entries.push_back({{x, x, x + 1e199, x + 1e199, 0, k % 3 ? INFINITY : 1}, {k}});
  }
  const LodTree tree = LodTree::build(entries);
  EXPECT_EQ(tree.find_violation(), "");
  std::size_t found = 0;
  tree.traverse([](const LodBox&) { return true; }, [&](const LodTree::Entry&) { ++found; });
  EXPECT_EQ(found, entries.size());
}

TEST(LodTree, BuildGivesTheSamePagesForTheSameOrder) {
  Boxes boxes(seed());
  std::vector<Entry> all = boxes.take(5000);
  LodTree a = LodTree::build(all), b = LodTree::build(all);
  std::swap(all[0], all[4999]);
  all[0].box.xmin -= 1;
  LodTree c = LodTree::build(all);
  const Pages pages = pages_of(a);
  EXPECT_EQ(pages, pages_of(b));
  EXPECT_EQ(a.header_bytes(), b.header_bytes());
  EXPECT_NE(pages, pages_of(c));
}

TEST(LodTree, StoredPagesGiveTheTreeBack) {
  Boxes boxes(seed());
  std::vector<Entry> all = boxes.take(3000);
  LodTree tree = LodTree::build(all);
  Pages stored = pages_of(tree);
  for (const std::size_t removals : {2, 8, 14, 16}) {
    change(tree, all, boxes, 2000, removals);
    for (const std::uint32_t p : tree.take_freed_pages()) stored.erase(p);
    const Pages dirty = pages_of(tree);
    for (const auto& [index, bytes] : dirty) stored[index] = bytes;
    EXPECT_EQ(stored.size(), tree.shape().nodes);
    LodTree again = reopened(tree.header_bytes(), stored);
    expect_agrees(again, all, boxes, 50);
    EXPECT_TRUE(again.take_dirty_pages().empty());
    tree = std::move(again);
  }
}

TEST(LodTree, OneInsertionDirtiesFewPages) {
  Boxes boxes(seed());
  LodTree tree = LodTree::build(boxes.take(20000));
  EXPECT_EQ(tree.take_dirty_pages().size(), tree.shape().nodes);
  EXPECT_TRUE(tree.take_dirty_pages().empty());
  tree.insert(boxes.next());
  const std::size_t dirty = tree.take_dirty_pages().size();
  EXPECT_GE(dirty, 1u);
  EXPECT_LE(dirty, 7u);
}

TEST(LodTree, FewSurvivorsOfAManyArePackedAnew) {
  Boxes boxes(seed());
  std::vector<Entry> all = boxes.take(290000);
  LodTree tree = LodTree::build(all);
  Pages stored = pages_of(tree);
  ASSERT_GT(stored.size(), 4800u);
  while (all.size() > 300) {
    ASSERT_TRUE(tree.erase(all.back()));
    all.pop_back();
  }
  for (const std::uint32_t p : tree.take_freed_pages()) stored.erase(p);
  for (const auto& [index, bytes] : pages_of(tree)) stored[index] = bytes;
  EXPECT_LT(stored.rbegin()->first, 64u);
  LodTree again = reopened(tree.header_bytes(), stored);
  change(again, all, boxes, 5000, 4);
  expect_agrees(again, all, boxes, 50);
}

TEST(LodTree, PageFormatIsFrozen) {
  LodTree tree;
  tree.insert({{1, 2, 3, 4, 0.5f, kForever}, {0x0102030405060708u}});
  const std::vector<std::byte> page = tree.page_bytes(0);
  const unsigned char expected[] = {1,    0,    1, 0,    0,    0, 0,    0, 0,    0,    0xf0, 0x3f, 0,
                                    0,    0,    0, 0,    0,    0, 0x40, 0, 0,    0,    0,    0,    0,
                                    8,    0x40, 0, 0,    0,    0, 0,    0, 0x10, 0x40, 0,    0,    0,
                                    0x3f, 0,    0, 0x80, 0x7f, 8, 7,    6, 5,    4,    3,    2,    1};
  ASSERT_EQ(page.size(), sizeof expected);
  for (std::size_t i = 0; i < page.size(); ++i) EXPECT_EQ(int(page[i]), int(expected[i])) << i;
  const std::vector<std::byte> header = tree.header_bytes();
  const unsigned char header_expected[] = {2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0,
                                           1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  ASSERT_EQ(header.size(), sizeof header_expected);
  for (std::size_t i = 0; i < header.size(); ++i) EXPECT_EQ(int(header[i]), int(header_expected[i])) << i;
}

// A tree of three levels, its header and pages, to be damaged.
struct Stored {
  std::vector<std::byte> header;
  Pages pages;
  std::uint32_t root, inner;

  explicit Stored(Boxes& boxes) {
    LodTree tree = LodTree::build(boxes.take(5000));
    pages = pages_of(tree), header = tree.header_bytes();
    root = std::uint32_t(header[4]);
    inner = std::uint32_t(pages[root][4 + 40]);
  }
};

TEST(LodTree, RefusesDamagedPagesAndSaysWhy) {
  Boxes boxes(seed());
  const Stored sound(boxes);
  const auto refusal_of = [&](auto damage) {
    Stored s = sound;
    damage(s);
    return refusal(s.header, s.pages);
  };
  const auto expect = [&](const char* reason, auto damage) {
    const std::string told = refusal_of(damage);
    EXPECT_NE(told.find(reason), std::string::npos) << told << "\n instead of " << reason;
  };
  EXPECT_EQ(refusal_of([](Stored&) {}), "");  // the control
  expect("header has an unknown format", [](Stored& s) { s.header.pop_back(); });
  expect("header has an unknown format", [](Stored& s) { s.header[0] = std::byte{1}; });
  expect("impossible size", [](Stored& s) { s.header[23] = std::byte{1}; });
  expect("impossible size", [](Stored& s) { s.header.resize(s.header.size() + 4 * s.pages.size()); });
  expect("a free page that is none", [](Stored& s) { s.header.insert(s.header.end(), 4, std::byte{9}); });
  expect("is free twice", [](Stored& s) { s.header.insert(s.header.end(), 8, std::byte{0}); });
  expect("the root is no page", [](Stored& s) { s.header[6] = std::byte{9}; });
  expect("no such page", [](Stored& s) { s.pages.clear(); });
  expect("another height", [](Stored& s) { s.header[8] = std::byte{4}; });
  expect("another level", [](Stored& s) { s.header[8] = std::byte{2}; });
  expect("entries instead of", [](Stored& s) { s.header[12] ^= std::byte{1}; });
  expect("is cut short", [](Stored& s) { s.pages[0].resize(3); });
  expect("unknown format", [](Stored& s) { s.pages[0][0] = std::byte{7}; });
  expect("wrong number of entries", [](Stored& s) { s.pages[0].pop_back(); });
  expect("wrong number of entries", [](Stored& s) { s.pages[0][2] = std::byte{0xff}; });
  expect("hangs on no other", [](Stored& s) { s.header[20] ^= std::byte{128}; });
  expect("refers to a page that is none", [](Stored& s) { s.pages[0][1] = std::byte{1}; });
  expect("another level", [](Stored& s) { s.pages[0] = s.pages[s.inner]; });
  expect("holds a box that is none",
         [](Stored& s) { s.pages[0][4 + 7] = std::byte{0x7f}, s.pages[0][4 + 6] = std::byte{0xff}; });
  expect("not tight", [](Stored& s) { s.pages[s.root][4] ^= std::byte{1}; });
  expect("refers to a page that is none", [](Stored& s) { s.pages[s.root][4 + 40 + 5] = std::byte{1}; });
  expect("used twice",
         [](Stored& s) { std::copy_n(s.pages[s.inner].begin() + 4 + 48, 48, s.pages[s.inner].begin() + 4); });
  expect("used twice", [](Stored& s) { s.pages[s.inner][4 + 40] = std::byte(s.root); });  // a ring
  expect("free and used", [](Stored& s) { s.header.insert(s.header.end(), 4, std::byte{0}); });
  expect("entries", [](Stored& s) { s.pages[0].resize(4 + 48), s.pages[0][2] = std::byte{1}; });
  expect("has 1 entries",
         [](Stored& s) { s.pages[s.root].resize(4 + 48), s.pages[s.root][2] = std::byte{1}; });
}

TEST(LodTree, OpenReadsTheRootAloneAndAVisitTheRest) {
  Boxes boxes(seed());
  const Stored s(boxes);
  LodTree tree = reopened(s.header, s.pages);
  EXPECT_EQ(tree.loaded_pages(), 1u);
  const auto visited = tree.visit_uniform(kEverywhere, 1, [](const Entry&) {}).nodes;
  EXPECT_EQ(tree.loaded_pages(), visited);
  tree.drop_pages();
  EXPECT_EQ(tree.loaded_pages(), 0u);
  EXPECT_EQ(tree.visit_uniform(kEverywhere, 1, [](const Entry&) {}).nodes, visited);
}

TEST(LodTree, RandomDamageIsRefusedOrSound) {
  Boxes boxes(seed());
  const Stored sound(boxes);
  int refused = 0;
  for (int round = 0; round < 2000; ++round) {
    Stored s = sound;
    auto& page = std::next(s.pages.begin(), std::ptrdiff_t(boxes.below(s.pages.size())))->second;
    page[boxes.below(page.size())] ^= std::byte(1 << boxes.below(8));
    refused += !refusal(s.header, s.pages).empty();
  }
  EXPECT_GT(refused, 0);
  EXPECT_LT(refused, 2000);  // a patch id may be any number
}

TEST(LodTree, SmallQuestionsReadFewPages) {
  Boxes boxes(seed());
  const std::vector<Entry> all = boxes.take(20000);
  const LodTree bulk = LodTree::build(all);
  LodTree grown;
  for (const Entry& e : all) grown.insert(e);
  const auto pages = [](const LodTree& tree, const Extent& region, double error) {
    return tree.visit_uniform(region, error, [](const Entry&) {}).nodes;
  };
  EXPECT_EQ(pages(bulk, {2e6, 0, 2e6, 1}, 1), 1u);
  const Extent small{0, 5e6 + 1000, 1, 5e6 + 1001};
  EXPECT_LT(pages(bulk, small, 0.5), bulk.shape().nodes / 8);
  EXPECT_LT(pages(grown, small, 0.5), grown.shape().nodes / 8);
  std::size_t everything = 0;
  const auto cost = bulk.traverse([](const LodBox&) { return true; }, [&](const Entry&) { ++everything; });
  EXPECT_EQ(everything, all.size());  // the control: without a question every page is read
  EXPECT_EQ(cost.nodes, bulk.shape().nodes);
  EXPECT_EQ(cost.boxes, all.size() + bulk.shape().nodes - 1);
  EXPECT_GT(bulk.shape().fill, 0.8);
  EXPECT_GT(grown.shape().fill, 0.5);
}

}  // namespace
}  // namespace patchwork
