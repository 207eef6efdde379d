// patchwork cost: what it writes, and that no measured error leaves its bound.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/cli/command.h"

namespace patchwork {
namespace {

class CostTest : public CliTest {
 protected:
  /// Small enough for a test; timings are not looked at.
  Words cost(const std::string& database, const std::string& folder) const {
    return {"cost",      database, in_directory(folder), "--size", "64",    "--runs", "1",
            "--seconds", "0",      "--points",           "4000",   "--json"};
  }
  Json rows(const std::string& folder) const {
    return Json::parse(text_of(in_directory(folder + "/cost.json")), nullptr, false);
  }
};

TEST_F(CostTest, EveryMeasuredErrorKeepsToItsBound) {
  const std::string database = hill_database();
  const std::string survey = make(hill_file(90, 80, 150, -120, 2.5), "survey.tif");
  ASSERT_EQ(run({"import", database, survey, "--accuracy", "0.02", "--quiet"}).code, 0);
  const std::string hash = content_hash(database);
  const Json facts = json(cost(database, "out"));
  EXPECT_EQ(facts["beyond"], 0);
  EXPECT_EQ(content_hash(database), hash);
  const Json all = rows("out");
  ASSERT_TRUE(all.is_array());
  ASSERT_EQ(all.size(), facts["rows"]);
  int ladder = 0, bounded = 0, differ = 0, frames = 0, skies = 0;
  std::map<std::string, Json> same;  // the middle of the ladder is a setting of many knobs, measured once
  for (const Json& r : all) {
    for (const char* key :
         {"knob", "value", "error_asked", "bound", "error_max", "error_p99", "error_rms", "patches", "bytes",
          "ms_query", "ms_fetch", "ms_blend", "ms_tessellate", "ms_draw"})
      ASSERT_TRUE(r.contains(key)) << key;
    ladder += r["knob"] == "error";
    EXPECT_LE(r["error_p99"], r["error_max"]);
    EXPECT_LE(r["error_rms"], r["error_max"]);
    if (r["bound"].is_null()) continue;
    ++bounded, differ += r["error_max"] > 0;
    const bool drawn = !r["ms_draw"].is_null();
    skies += r["knob"] == "sky_directions";
    EXPECT_LE(double(r["error_max"]), double(r["bound"]) * (drawn ? 1.001 : 1) + (drawn ? 0.01 : 0))
        << r["knob"] << " " << r["value"];
    frames += drawn;
    EXPECT_EQ(drawn, r["knob"] == "frame" || r["knob"] == "tessellation" || r["knob"] == "sky_directions" ||
                         (r["knob"] == "reference" && r["unit"] == "px"));
    EXPECT_GT(r["patches"], 0);
    EXPECT_GE(r["ms_blend"], 0);
    const std::string setting = std::string(r["knob"]) + " " + std::string(r["value"]);
    for (const char* one : {"smoothness 0", "blend priority", "engine cpu", "side 64"})
      if (setting == one) same["heights"].push_back(r["ms_total"]);
    for (const char* one : {"frame 2", "tessellation hardware", "sky_directions no sky light"})
      if (setting == one) same["frame"].push_back(r["ms_total"]);
  }
  for (const auto& [what, times] : same)
    EXPECT_EQ(std::set<double>(times.begin(), times.end()).size(), 1u) << what << " " << times;
  EXPECT_EQ(same["heights"].size(), 4u);
  EXPECT_EQ(same["frame"].size(), 3u);
  EXPECT_EQ(ladder, 15);
  EXPECT_EQ(frames, 12) << "published tessellation has no bound";
  EXPECT_EQ(skies, 4) << "no sky light, and that of 4, 8 and 16 directions";
  EXPECT_GT(bounded, 50);
  EXPECT_GT(differ, 20) << "negative control: coarser answers depart from the best";
}

TEST_F(CostTest, AGridThatIsNotAsAccurateAsItSaysIsFound) {
  const std::string database = hill_database();
  RasterFile off = hill_file(90, 80, 150, -120, 2.5);
  off.at = [at = off.at](int i, int j) { return at(i, j) + 5 + (i + j) % 7; };
  ASSERT_EQ(run({"import", database, make(off, "off.tif"), "--accuracy", "0.02", "--quiet"}).code, 0);
  const Outcome o = run(cost(database, "out"));
  EXPECT_NE(complaint(o).find("beyond their bounds"), std::string::npos) << complaint(o);
  EXPECT_NE(text_of(in_directory("out/index.html")).find("measured errors are beyond"), std::string::npos);
}

TEST_F(CostTest, FilesSayTheSameAndThePageNeedsNothingElse) {
  const std::string database = hill_database();
  const Json facts = json(cost(database, "Anna's out"));
  const Json all = rows("Anna's out");
  const std::vector<std::string> csv = lines_of(text_of(in_directory("Anna's out/cost.csv")));
  ASSERT_EQ(csv.size(), all.size() + 1);
  const auto fields = [](const std::string& line) {  // what stands in quotes is one
    bool quoted = false;
    return 1 + std::count_if(line.begin(), line.end(), [&](char c) {
             quoted ^= c == '"';
             return c == ',' && !quoted;
           });
  };
  for (const std::string& line : csv) EXPECT_EQ(fields(line), fields(csv[0])) << line;
  // Two reports compare by the ratios of their times to those of terrain that is the same everywhere.
  std::vector<int> reference;
  for (const Json& r : all) {
    EXPECT_NEAR(double(r["of_reference"]) * double(facts["reference_ms"]), double(r["ms_total"]),
                1e-9 * double(r["ms_total"]));
    if (r["knob"] == "reference") reference.push_back(r["patches"]);
  }
  ASSERT_EQ(reference.size(), 4u) << "three of the blend, a frame";
  EXPECT_EQ(reference[0], 1321) << "of any database";
  EXPECT_GT(reference[0], reference[1]);
  EXPECT_GT(reference[1], reference[2]);
  EXPECT_TRUE(csv[0].starts_with(
      "knob,value,error_asked,bound,error_max,error_p99,error_rms,patches,bytes,ms_query,ms_fetch,ms_blend,"
      "ms_tessellate,ms_draw,"));
  EXPECT_TRUE(csv[1].starts_with("error,0,0"));
  const std::string page = text_of(in_directory("Anna's out/index.html"));
  std::size_t plots = 0;
  for (const Json& name : facts["files"]) {
    const std::string file = name;
    EXPECT_FALSE(text_of(in_directory("Anna's out/" + file)).empty()) << file;
    plots += file.ends_with(".svg");
  }
  std::size_t inlined = 0;
  for (std::size_t at = page.find("<svg"); at != std::string::npos; at = page.find("<svg", at + 1)) ++inlined;
  EXPECT_EQ(inlined, plots);
  EXPECT_GE(plots, 10u);
  EXPECT_EQ(page.find("src="), std::string::npos);
  EXPECT_EQ(page.find("<link"), std::string::npos);
  EXPECT_TRUE(page.ends_with("</html>\n"));
  EXPECT_EQ(facts["budgets"].size(), 20u);
}

TEST_F(CostTest, LeavesAModelThatExplains) {
  const std::string database = hill_database();
  const Words explain{"query", database, "--error", "1", "--explain", "--json"};
  EXPECT_FALSE(json(explain)["expected"].contains("read_seconds")) << "nothing is known of reading yet";
  json(cost(database, "out"));
  const Json expected = json(explain)["expected"];
  EXPECT_GT(expected["read_seconds"], 0);
  EXPECT_GT(expected["blend_seconds_of_a_million_heights"], 0);
  EXPECT_EQ(json(explain)["expected"], expected) << "it is kept, not measured anew";
}

TEST_F(CostTest, RefusesWhatCannotBeMeasured) {
  const std::string database = hill_database();
  Words words = cost(database, "out");
  words.insert(words.end(), {"--extent", "0", "0", "10", "10"});
  EXPECT_NE(complaint(run(words)).find("beside the database"), std::string::npos);
  write_text(in_directory("file"), "in the way");
  EXPECT_NE(complaint(run(cost(database, "file"))).find("cannot be made"), std::string::npos);
  EXPECT_NE(complaint(run(cost(in_directory("none.pwk"), "out"))).find("no such database"),
            std::string::npos);
  EXPECT_EQ(run({"cost", database}).code, 2);
}

}  // namespace
}  // namespace patchwork
