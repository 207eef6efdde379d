// patchwork selftest: hard cases on a person's own database.
#include <gtest/gtest.h>

#include "tests/cli/command.h"

namespace patchwork {
namespace {

class SelfTest : public CliTest {
 protected:
  static Json case_named(const Json& report, const std::string& name) {
    for (const Json& c : report["cases"])
      if (c["case"] == name) return c;
    return {};
  }
};

TEST_F(SelfTest, EveryCaseHoldsOnASoundDatabaseAndLeavesItAsItIs) {
  const std::string database = hill_database();
  RasterFile survey = hill_file(90, 80, 150, -120, 2.5);
  ASSERT_EQ(run({"import", database, make(survey, "survey.tif"), "--accuracy", "0.02", "--quiet"}).code, 0);
  const std::string hash = content_hash(database);
  const Json report = json({"selftest", database, "--tries", "1000", "--json"});
  EXPECT_EQ(report["sound"], true);
  EXPECT_EQ(report["cases"].size(), 14u);
  for (const Json& c : report["cases"]) {
    EXPECT_EQ(c["left_out"], "") << c["case"];
    EXPECT_GT(c["tries"], 0) << c["case"];
    EXPECT_LE(c["worst"], c["limit"]) << c["case"];
  }
  EXPECT_GT(case_named(report, "BoundHolds")["worst"], 0.1) << "negative control: something was measured";
  EXPECT_GT(case_named(report, "CpuGpuParity")["worst"], 0) << "two engines, not one twice";
  EXPECT_EQ(content_hash(database), hash);
}

TEST_F(SelfTest, AGridThatIsNotAsAccurateAsItSaysFails) {
  const std::string database = hill_database();
  RasterFile off = hill_file(90, 80, 150, -120, 2.5);
  off.at = [at = off.at](int i, int j) { return at(i, j) + 5 + (i + j) % 7; };
  ASSERT_EQ(run({"import", database, make(off, "off.tif"), "--accuracy", "0.02", "--quiet"}).code, 0);
  const Outcome o = run({"selftest", database, "--tries", "1000", "--json"});
  EXPECT_NE(complaint(o).find("do not hold"), std::string::npos) << complaint(o);
  const Json report = Json::parse(o.out, nullptr, false);
  EXPECT_EQ(report["sound"], false);
  EXPECT_EQ(case_named(report, "BoundHolds")["holds"], false);
  EXPECT_EQ(case_named(report, "SummationOrder")["holds"], true) << "the others are not to blame";
}

TEST_F(SelfTest, PrintsATable) {
  const Outcome o = run({"selftest", hill_database(), "--tries", "200"});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(lines_of(o.out).size(), 15u);
  EXPECT_TRUE(o.out.starts_with("case"));
  EXPECT_EQ(run({"selftest", in_directory("none.pwk")}).code, 1);
}

}  // namespace
}  // namespace patchwork
