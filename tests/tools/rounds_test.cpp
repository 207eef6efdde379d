// Rounds of measuring: which runs count.
#include "tools/cost/rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <thread>

namespace patchwork::cli {
namespace {

constexpr std::chrono::steady_clock::time_point kNoTime{};

// A machine whose runs take 10 ms at their calmest, and up to twice as long when it is disturbed.
struct Machine {
  bool shared = true;
  int runs = 0;
  std::vector<int> order;

  MeasuredRun run(int name) {
    return [this, name](Stages& ms) {
      order.push_back(name);
      ms.query.push_back(1), ms.fetch.push_back(9 + (shared ? 10 * std::fmod(0.382 * ++runs, 1) : 0));
    };
  }
};

TEST(RoundsTest, OfEachTheFastestQuarterCounts) {
  Machine machine;
  const std::vector<MeasuredRun> all{machine.run(0), machine.run(1), machine.run(2)};
  double share = 0;
  const std::vector<Stages> times =
      measure(all, {.least = 41, .until = kNoTime, .progress = [&](double s) { share = s; }});
  ASSERT_EQ(times.size(), 3u);
  EXPECT_EQ(machine.order.size(), 3u * 41);
  EXPECT_GT(share, 0.9);
  for (const Stages& ms : times) {
    const std::vector<double> total = ms.total();
    EXPECT_EQ(total.size(), 10u);
    EXPECT_EQ(ms.query.size(), total.size());
    EXPECT_TRUE(ms.blend.empty()) << "there was nothing to blend";
    for (const double t : total) EXPECT_LT(t, 13);  // negative control: they take 10 to 20
  }
}

TEST(RoundsTest, OfFewRunsThreeCount) {
  for (const int least : {1, 2, 3, 4, 5, 6, 8}) {
    Machine machine;
    const std::vector<MeasuredRun> all{machine.run(0)};
    const std::size_t counted =
        measure(all, {.least = least, .until = kNoTime, .progress = [](double) {}})[0].query.size();
    EXPECT_EQ(counted, std::size_t(std::min(least, 3))) << least;
  }
}

TEST(RoundsTest, EachRoundHasAnotherOrder) {
  Machine machine;
  std::vector<MeasuredRun> all;
  for (int k = 0; k < 10; ++k) all.push_back(machine.run(k));
  measure(all, {.least = 4, .until = kNoTime, .progress = [](double) {}});
  ASSERT_EQ(machine.order.size(), 40u);
  std::set<std::vector<int>> orders;
  for (std::size_t round = 0; round < 4; ++round) {
    std::vector<int> met(machine.order.begin() + long(10 * round),
                         machine.order.begin() + long(10 * round + 10));
    orders.insert(met);
    std::sort(met.begin(), met.end());
    for (int k = 0; k < 10; ++k) EXPECT_EQ(met[std::size_t(k)], k) << "each once";
  }
  EXPECT_EQ(orders.size(), 4u);
}

TEST(RoundsTest, EndsOnceAllAreSure) {
  for (const bool shared : {false, true}) {
    Machine machine;
    machine.shared = shared;
    const std::vector<MeasuredRun> all{machine.run(0)};
    const auto soon = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
    const auto later = soon + std::chrono::hours(1);
    measure(all, {.least = 5, .until = shared ? soon : later, .progress = [](double) {}});
    if (shared)
      EXPECT_GT(machine.order.size(), 5u) << "negative control: it goes on until its time has come";
    else
      EXPECT_EQ(machine.order.size(), 5u);
  }
}

TEST(RoundsTest, WhatTakesLongerIsVisitedLessOftenButOftenEnough) {
  using namespace std::chrono_literals;
  int visits[2] = {};
  const auto sleeper = [&](int k, std::chrono::milliseconds length) {
    return [&visits, k, length](Stages& ms) {
      std::this_thread::sleep_for(length);
      ms.query.push_back(double(length.count()) + ++visits[k] % 7);  // never sure
    };
  };
  const std::vector<MeasuredRun> all{sleeper(0, 1ms), sleeper(1, 30ms)};
  for (const int least : {3, 6}) {
    visits[0] = visits[1] = 0;
    measure(all,
            {.least = least, .until = std::chrono::steady_clock::now() + 300ms, .progress = [](double) {}});
    EXPECT_GT(visits[0], visits[1]);
    EXPECT_GE(visits[1], least);
  }
}

}  // namespace
}  // namespace patchwork::cli
