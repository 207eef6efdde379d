// Slots read when first asked for: once, by many threads, and again after they were let go.
#include "db/lazy_table.h"

#include <gtest/gtest.h>

#include <thread>

namespace patchwork {
namespace {

struct Slot {
  std::size_t number = 0;
};

TEST(LazyTable, ManyThreadsReadEverySlotAndEachIsMadeOnce) {
  std::atomic<int> made{0};
  LazyTable<Slot> table(1000, [&](std::size_t i) {
    ++made;
    return std::make_unique<Slot>(Slot{i});
  });
  for (int round = 1; round <= 2; ++round) {
    std::atomic<int> wrong{0};
    std::vector<std::thread> readers;
    for (std::size_t r = 0; r < 4; ++r)
      readers.emplace_back([&, r] {
        for (std::size_t n = 0; n < 4000; ++n) {
          const std::size_t i = (n * 7 + r * 250) % table.size();
          wrong += table[i].number != i;
        }
      });
    for (std::thread& r : readers) r.join();
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(made, 1000 * round);
    EXPECT_EQ(table.loaded(), 1000u);
    table.drop_unchanged();
    EXPECT_EQ(table.loaded(), 0u);
  }
}

TEST(LazyTable, ChangedSlotsStayAndAreTakenOnce) {
  LazyTable<Slot> table(8, [](std::size_t i) { return std::make_unique<Slot>(Slot{i}); });
  table.change(3).number = 33;
  table.put(9, std::make_unique<Slot>(Slot{99}));
  table.give_up(5);
  table.drop_unchanged();
  EXPECT_EQ(table[3].number, 33u);
  EXPECT_EQ(table.take_changed(), (std::vector<std::uint32_t>{3, 9}));
  EXPECT_EQ(table.take_given_up(), (std::vector<std::uint32_t>{5}));
  EXPECT_TRUE(table.take_changed().empty());
  table.drop_unchanged();
  EXPECT_EQ(table[3].number, 3u) << "stored slots are read again";
}

}  // namespace
}  // namespace patchwork
