// What is expected of an answer beside what it is.
#include "query/cost_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/grids.h"

namespace patchwork {
namespace {

double rough(double x, double y) {
  return 40 * std::sin(x / 170) * std::cos(y / 130) + 5 * std::sin(x / 21 + y / 37) + std::sin(x * 1.7 + y);
}

class CostModelTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new GridFolder;
    db_ = new Database(folder_->database());
    folder_->add(*db_, of_terrain({.width = 900, .height = 800, .geotransform = {0, 5, 0, 0, 0, -5}}, rough),
                 "base");
  }
  static void TearDownTestSuite() { delete db_, delete folder_; }
  static GridFolder* folder_;
  static Database* db_;
};
GridFolder* CostModelTest::folder_ = nullptr;
Database* CostModelTest::db_ = nullptr;

TEST_F(CostModelTest, WhatIsExpectedIsWhatIsFoundWhereEveryLeafIsRead) {
  const CostModel model{1e-6, 1e-7, 1e-8};
  for (const double error : {0.0, 0.3, 2.0, 10.0, 100.0}) {
    const UniformCut cut{.error = error, .region = Region::inside(Extent{500, -3000, 3000, -500})};
    const Cost expected = expect(*db_, *make_surface(cut), model), found = extract(*db_, cut).cost;
    ASSERT_LE(found.nodes, kSampledLeaves);
    EXPECT_EQ(expected.nodes, found.nodes);
    EXPECT_EQ(expected.boxes, found.boxes);
    EXPECT_NEAR(double(expected.patches), double(found.patches), 1 + 0.1 * double(found.patches))
        << "boxes are rounded outward, no more";
    EXPECT_EQ(expected.seconds, model.seconds(double(expected.nodes), double(expected.patches)));
  }
}

TEST_F(CostModelTest, AModelHasNoCostsBelowZero) {
  const CostModel model = calibrate(*db_);
  EXPECT_GE(model.fixed, 0);
  EXPECT_GE(model.page, 0);
  EXPECT_GE(model.patch, 0);
  EXPECT_GT(model.fixed + model.page + model.patch, 0);
}

TEST_F(CostModelTest, ErrorFallsWithTheTimeThatMayBeTaken) {
  const CostModel model{2e-6, 1e-6, 1e-6};  // a machine that never changes
  const auto cut_at = [](double error) { return make_surface(UniformCut{.error = error}); };
  double last = INFINITY;
  for (const double seconds : {1e-9, 1e-5, 3e-5, 1e-4, 3e-4, 1.0}) {
    const Budgeted b = extract_in_time(*db_, model, seconds, 200, cut_at);
    EXPECT_LE(b.error, last) << seconds;
    EXPECT_EQ(b.extraction.patches, extract(*db_, {.error = b.error}).patches);
    if (b.error < 200) {
      EXPECT_LE(expect(*db_, *cut_at(b.error), model).seconds, seconds);
    }
    last = b.error;
  }
  EXPECT_EQ(last, 0);
}

}  // namespace
}  // namespace patchwork
