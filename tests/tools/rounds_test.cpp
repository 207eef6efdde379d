// Rounds of measuring: which runs count.
#include "tools/cost/rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace patchwork::cli {
namespace {

constexpr std::chrono::steady_clock::time_point kNoTime{};

// A machine whose runs take 10 ms at their calmest, and as much longer as it is disturbed.
struct Machine {
  double disturbed = 0;
  int looks = 0;
  std::vector<int> order;

  double look() { return disturbed = 10 * std::fmod(0.382 * ++looks, 1); }
  MeasuredRun run(int name) {
    return [this, name](Stages& ms) {
      order.push_back(name);
      ms.query.push_back(1), ms.fetch.push_back(9 + disturbed);
    };
  }
};

TEST(RoundsTest, OfEachRunTheCalmerHalfCounts) {
  Machine machine;
  const std::vector<MeasuredRun> all{machine.run(0), machine.run(1), machine.run(2)};
  double share = 0;
  const std::vector<Stages> times = measure(all, {.least = 41,
                                                  .until = kNoTime,
                                                  .disturbance = [&] { return machine.look(); },
                                                  .progress = [&](double s) { share = s; }});
  ASSERT_EQ(times.size(), 3u);
  EXPECT_EQ(machine.order.size(), 3u * 42) << "one round warms up";
  EXPECT_EQ(machine.looks, 3 * 41);
  EXPECT_GT(share, 0.9);
  for (const Stages& ms : times) {
    const std::vector<double> total = ms.total();
    EXPECT_EQ(total.size(), 21u);
    EXPECT_EQ(ms.query.size(), total.size());
    EXPECT_TRUE(ms.blend.empty()) << "there was nothing to blend";
    for (const double t : total) EXPECT_LT(t, 16) << "negative control: disturbed runs take up to 20";
  }
}

TEST(RoundsTest, ARoundBeginsWhereTheOneBeforeDidNot) {
  Machine machine;
  std::vector<MeasuredRun> all;
  for (int k = 0; k < 10; ++k) all.push_back(machine.run(k));
  measure(all, {.least = 3, .until = kNoTime, .disturbance = [] { return 0; }, .progress = [](double) {}});
  ASSERT_EQ(machine.order.size(), 40u);
  for (std::size_t round = 0; round < 4; ++round) {
    std::vector<int> met(machine.order.begin() + long(10 * round),
                         machine.order.begin() + long(10 * round + 10));
    if (round > 0) {
      EXPECT_NE(met[0], machine.order[10 * round - 10]);
    }
    std::sort(met.begin(), met.end());
    for (int k = 0; k < 10; ++k) EXPECT_EQ(met[std::size_t(k)], k) << "each once";
  }
}

TEST(RoundsTest, EndsOnceAllAreSure) {
  Machine machine;  // never disturbed: all take the same time
  const auto later = std::chrono::steady_clock::now() + std::chrono::hours(1);
  const std::vector<MeasuredRun> steady{machine.run(0)};
  measure(steady, {.least = 5, .until = later, .disturbance = [] { return 0; }, .progress = [](double) {}});
  EXPECT_EQ(machine.order.size(), 6u);
  machine.order.clear();
  const std::vector<MeasuredRun> unsteady{machine.run(0)};
  measure(
      unsteady,
      {.least = 5, .until = later, .disturbance = [&] { return machine.look(); }, .progress = [](double) {}});
  EXPECT_EQ(machine.order.size(), std::size_t(kMostRuns) + 1) << "negative control";
}

TEST(MemoryProbeTest, WalksFromPlaceToPlace) {
  MemoryProbe probe;
  const double first = probe(), second = probe();
  EXPECT_GT(first, 0);
  EXPECT_GT(second, 0);
}

}  // namespace
}  // namespace patchwork::cli
