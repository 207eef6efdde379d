// What is expected of an answer beside what it is.
#include "query/cost_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/grids.h"

namespace patchwork {
namespace {

class CostModelTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new GridFolder;
    db_ = new Database(folder_->database());
    folder_->add(
        *db_, of_terrain({.width = 900, .height = 800, .geotransform = {0, 5, 0, 0, 0, -5}}, rough_terrain),
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
  const CostModel model{2e-3, 1e-3, 1e-3};  // slower than any machine: no answer misses its time
  const auto cut_at = [](double error) { return make_surface(UniformCut{.error = error}); };
  double last = INFINITY;
  for (const double seconds : {1e-9, 1e-2, 3e-2, 1e-1, 3e-1, 1e3}) {
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

TEST_F(CostModelTest, AnAnswerThatMissesItsTimeBecomesCoarser) {
  const auto cut_at = [](double error) { return make_surface(UniformCut{.error = error}); };
  const Budgeted in_vain = extract_in_time(*db_, CostModel{}, 1e-12, 200, cut_at);
  EXPECT_GT(in_vain.error, 0) << "a model that promises everything at once";
  EXPECT_EQ(in_vain.extraction.patches, extract(*db_, {.error = in_vain.error}).patches);
  EXPECT_EQ(extract_in_time(*db_, CostModel{}, 1e3, 200, cut_at).error, 0);
}

TEST(CostModel, LargeAnswersTakeMoreForEachPatch) {
  const CostModel truth{.fixed = 1e-6, .patch = 8e-8, .beyond = 1e-7};
  std::vector<Measured> answers;
  for (double patches = 10; patches < 1e6; patches *= 3)
    answers.push_back({.pages = patches / 50, .patches = patches, .find = truth.seconds(0, patches)});
  const CostModel found = fit(answers);
  EXPECT_NEAR(found.seconds(0, 5e5), truth.seconds(0, 5e5), 0.01 * truth.seconds(0, 5e5));
  EXPECT_GT(found.seconds(0, 2e5), 2 * found.seconds(0, 1e5));
}

TEST(CostModel, FitFindsTheCostsThatTimesWereMadeOf) {
  const CostModel truth{.fixed = 2e-6,
                        .page = 3e-7,
                        .patch = 2e-8,
                        .read_fixed = 1e-4,
                        .read_patch = 5e-6,
                        .blend_fixed = 3e-5,
                        .blend_patch = 1e-6,
                        .sample = 2e-8,
                        .edge = 4e-7};
  std::vector<Measured> answers;
  for (const double pages : {1, 3, 10, 40})
    for (const double samples : {1e3, 3e4, 1e6}) {
      const double patches = pages * pages * 7;
      answers.push_back({pages, patches, samples, truth.seconds(pages, patches), truth.read_seconds(patches),
                         truth.blend_seconds(patches, samples)});
    }
  const CostModel found = fit(answers);
  EXPECT_NEAR(found.fixed, truth.fixed, 1e-9 * truth.fixed);
  EXPECT_NEAR(found.page, truth.page, 1e-9 * truth.page);
  EXPECT_NEAR(found.patch, truth.patch, 1e-9 * truth.patch);
  EXPECT_NEAR(found.read_patch, truth.read_patch, 1e-9 * truth.read_patch);
  EXPECT_NEAR(found.blend_patch, truth.blend_patch, 1e-6 * truth.blend_patch);
  EXPECT_NEAR(found.sample, truth.sample, 1e-6 * truth.sample);
  EXPECT_NEAR(found.edge, truth.edge, 1e-6 * truth.edge);
  EXPECT_TRUE(found.knows_heights());
}

TEST(CostModel, FitLeavesOutCostsThatWouldBeBelowZero) {
  // More pages take less time: no page is paid for, and what is left explains what it can.
  const Measured answers[] = {{.pages = 1, .patches = 10, .find = 9e-6},
                              {.pages = 5, .patches = 10, .find = 5e-6},
                              {.pages = 9, .patches = 20, .find = 6e-6}};
  const CostModel found = fit(answers);
  EXPECT_EQ(found.page, 0);
  EXPECT_GE(found.fixed, 0);
  EXPECT_GE(found.patch, 0);
  EXPECT_GT(found.fixed + found.patch, 0);
  EXPECT_FALSE(found.knows_heights()) << "nothing was said of them";
}

TEST(CostModel, IsKeptInTheDatabaseAndIsNoPartOfItsContent) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, of_terrain({}, rough_terrain), "base");
  EXPECT_FALSE(saved_model(db));
  const std::string hash = db.content_hash();
  const std::uint64_t version = db.version();
  const CostModel model{1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6, 7e-6, 8e-6, 9e-6};
  save_model(db, model);
  EXPECT_EQ(db.content_hash(), hash);
  EXPECT_EQ(db.version(), version);
  EXPECT_TRUE(db.check().empty());
  const Database again = Database::open(db.path());
  EXPECT_EQ(again.content_hash(), hash);
  const std::optional<CostModel> kept = saved_model(again);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->seconds(3, 5), model.seconds(3, 5));
  EXPECT_EQ(kept->read_seconds(7), model.read_seconds(7));
  EXPECT_EQ(kept->blend_seconds(7, 11), model.blend_seconds(7, 11));
  EXPECT_EQ(model_of(again).sample, model.sample) << "what is kept is used";
  EXPECT_FALSE(refusal_of([&] { Database::open(db.path()).keep_remark("a", "b"); }).empty());
}

TEST(CostModel, OfAnotherMachineOrDamagedIsNotUsed) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, of_terrain({}, rough_terrain), "base");
  save_model(db, {1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6});
  const std::string sound = *db.remark("cost model");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = sound;
    text.replace(text.find(from), from.size(), to);
    db.keep_remark("cost model", text);
    return saved_model(db).has_value();
  };
  EXPECT_TRUE(with("1e-06", "1e-05")) << "negative control: what is sound is taken";
  EXPECT_FALSE(with(machine_name(), "another one"));
  EXPECT_FALSE(with("1e-06", "-1e-06"));
  EXPECT_FALSE(with("1e-06", "\"much\""));
  EXPECT_FALSE(with("\"sample\"", "\"simple\""));
  EXPECT_FALSE(with("{", ""));
  EXPECT_EQ(model_of(db).sample, 0) << "a new one knows of finding alone";
}

}  // namespace
}  // namespace patchwork
