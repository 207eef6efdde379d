// What is concluded from rows of times.
#include <gtest/gtest.h>

#include "tools/cost/cost.h"

namespace patchwork::cli {
namespace {

CostReport ladder(const std::vector<double>& ms) {
  CostReport report;
  double bound = 0.1;
  for (const double t : ms) {
    report.rows.push_back({.knob = "error", .value = "", .bound = bound});
    report.rows.back().ms.blend = {t};
    bound *= 2;
  }
  return report;
}

TEST(JudgeTest, TheKneeIsWhereTimeStopsFalling) {
  CostReport report = ladder({64, 32, 16, 8, 7.9, 7.8, 7.7});
  find_knee(report);
  EXPECT_EQ(report.knee, 3u);
}

TEST(JudgeTest, ThereIsNoKneeWhereNothingIsBought) {
  for (const std::vector<double>& ms :
       {std::vector<double>{8, 8.1, 7.9, 8}, {5, 6, 7, 8}, {8, 8, 8, 8 / 1.24}}) {
    CostReport report = ladder(ms);
    report.knee = 2;
    find_knee(report);
    EXPECT_FALSE(report.knee) << ms.back();
  }
  CostReport none = ladder({});
  find_knee(none);
  EXPECT_FALSE(none.knee);
}

// Up to there less error is nearly free.
TEST(JudgeTest, TheKneeIsWhereTimeBeginsToFall) {
  CostReport report = ladder({8, 7.9, 7.8, 7.7, 1});
  find_knee(report);
  EXPECT_EQ(report.knee, 3u);
}

}  // namespace
}  // namespace patchwork::cli
