// The questions of surveyors: sight, profile, accuracy and volume, as a person asks them.
#include <cmath>

#include "tests/cli/command.h"

namespace patchwork {

namespace {

// A plain of 100 m with a wall of 20 m along x = 500 300, cells of 10 m.
RasterFile walled_plain() {
  RasterFile f{.width = 101, .height = 61};
  f.geotransform = {500000, 10, 0, 5000000, 0, -10};
  f.at = [](int i, int) { return i == 30 ? 120.0 : 100.0; };
  return f;
}

}  // namespace

class Survey : public CliTest {
 protected:
  Survey() {
    const std::string file = make(walled_plain(), "plain.tif");
    EXPECT_EQ(run({"import", database_, file, "--accuracy", "0.1", "--quiet"}).code, 0);
  }
  const std::string database_ = in_directory("plain.pwk");
};

using SightVerb = Survey;

TEST_F(SightVerb, TellsWhatHidesATarget) {
  const Words ends{"--from", "500105", "4999705", "1.8", "--to", "500805", "4999705", "2"};
  Words words{"sight", database_, "--json"};
  words.insert(words.end(), ends.begin(), ends.end());
  const Json ray = json(words)["rays"][0];
  EXPECT_EQ(ray["visible"], false);
  EXPECT_EQ(ray["verdict"], "hidden");
  EXPECT_NEAR(ray["nearest"]["distance"].get<double>(), 200, 1) << "the wall's crest";
  EXPECT_NEAR(ray["clearance"].get<double>(), 101.86 - 120, 0.05);
  EXPECT_NEAR(ray["hit"]["distance"].get<double>(), 190.9, 0.2) << "on its slope";
  Words text = words;
  text.erase(text.begin() + 2);
  const Outcome o = run(text);
  EXPECT_EQ(o.code, 0);
  EXPECT_SAYS(o.out, "hidden, whatever the terrain is within its bounds");
  text[5 + 0] = "30";  // from high above
  EXPECT_SAYS(run(text).out, "visible");
}

TEST_F(SightVerb, FindsTheFirstHitOfARay) {
  const Json ray =
      json({"sight", database_, "--json", "--flat", "--from", "500105", "4999705", "10", "--distance", "150",
            "--azimuth", "90", "--elevation", "-5.710593137499643"})["rays"][0];
  EXPECT_NEAR(ray["hit"]["distance"].get<double>(), 100, 0.01) << "falls by a tenth";
  EXPECT_NEAR(ray["hit"]["at"][0].get<double>(), 500205, 0.01);
  EXPECT_EQ(json({"sight", database_, "--json", "--from", "500105", "4999705", "10", "--distance", "150",
                  "--azimuth", "90"})["rays"][0]["hit"],
            nullptr);
}

TEST_F(SightVerb, AnswersLinesInOrder) {
  const Outcome o = run(
      {"sight", database_},
      {.input = "500105 4999705 1.8 500805 4999705 2\n# a comment\n\n500105,4999705,1,500205,4999705,1\n"});
  ASSERT_EQ(o.code, 0) << o.err;
  const Words lines = lines_of(o.out);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].rfind("hidden hidden -18.", 0), 0u) << lines[0];
  EXPECT_EQ(lines[1].rfind("visible visible ", 0), 0u) << lines[1];
  EXPECT_EQ(run({"sight", database_}, {.input = ""}).code, 0);
}

TEST_F(SightVerb, TakesTablesWithNamedColumns) {
  const auto answer = [&](const std::string& input) {
    const Outcome o = run({"sight", database_}, {.input = input});
    EXPECT_EQ(o.code, 0) << o.err;
    return o.out;
  };
  const std::string want = answer("500105 4999705 1.8 500805 4999705 2\n");
  EXPECT_NE(want, answer("500105 4999705 1.8 500205 4999705 2\n"));
  for (const char* form : {"x,y,h,x,y,h\n500105,4999705,1.8,500805,4999705,2\n",
                           "\xEF\xBB\xBFmast;easting;northing;height;easting;northing;height\n"
                           "\"Hill; east\";500105;4999705;1.8;500805;4999705;2\n",
                           "500105,4999705,1.8 500805,4999705,2\n", "500105 4999705 1.8; 500805 4999705 2\n",
                           "x1,y1,h1,x2,y2,h2\n500105,4999705,1.8,500805,4999705,2\n",
                           "y\tx\ty\tx\th\th\tnote\n4999705\t500105\t4999705\t500805\t1.8\t2\tseen?\n"})
    EXPECT_EQ(answer(form), want) << form;
  EXPECT_SAYS(complaint(run({"sight", database_}, {.input = "x,y,h,x,y\n1,2,3,4,5\n"})), "line 1");
  EXPECT_SAYS(complaint(run({"sight", database_}, {.input = "x,y,h,x,y,name\n1,2,3,4,5,6\n"})),
              "no column h2");
  EXPECT_SAYS(
      complaint(run({"sight", database_}, {.input = "500105,5;4999705,5;1,8;500805,5;4999705,5;2,0\n"})),
      "line 1");
}

TEST_F(SightVerb, RefusesWhatItCannotRead) {
  EXPECT_SAYS(complaint(run({"sight", database_}, {.input = "1 2 3\n"})), "line 1");
  EXPECT_SAYS(complaint(run({"sight", database_}, {.input = "0 0 3 500105 4999705 1\n"})), "no ground");
  EXPECT_EQ(run({"sight", database_, "--absolute"}, {.input = "0 0 103 500105 4999705 101\n"}).code, 0);
  EXPECT_EQ(run({"sight", database_, "--from", "1", "2", "3"}).code, 2);
  EXPECT_EQ(run({"sight", database_, "--to", "1", "2", "3"}).code, 2);
}

using ProfileVerb = Survey;

TEST_F(ProfileVerb, WritesPointsAndSumsThemUp) {
  const Json p =
      json({"profile", database_, "--json", "--line", "500105 4999705, 500505 4999705", "--step", "10"});
  EXPECT_EQ(p["length"], 400);
  EXPECT_EQ(p["points"].size(), 41u);
  EXPECT_NEAR(p["ascent"].get<double>(), 20, 1e-3);
  EXPECT_NEAR(p["descent"].get<double>(), 20, 1e-3);
  EXPECT_NEAR(p["highest"].get<double>(), 120, 1e-3);
  EXPECT_GE(p["bound_max"].get<double>(), 0.1);
  const Outcome o = run({"profile", database_, "--line", "LINESTRING(500105 4999705, 500505 4999705)"});
  EXPECT_EQ(o.code, 0);
  EXPECT_EQ(lines_of(o.out).size(), 41u) << "the grid's own step";
  EXPECT_SAYS(o.out, " plain");
  EXPECT_SAYS(o.err, "up 20.00 m");
}

TEST_F(ProfileVerb, RefusesWhatIsNoLine) {
  EXPECT_SAYS(complaint(run({"profile", database_, "--line", "1 2", "--step", "1"})), "two points");
  EXPECT_SAYS(complaint(run({"profile", database_, "--line", "1 2, x"})), "cannot read");
  EXPECT_EQ(run({"profile", database_}).code, 2);
}

class Surveys : public Survey {
 protected:
  // A second survey of the plain's east, 3 m lower, twice as accurate.
  Surveys() {
    RasterFile f{.width = 41, .height = 61};
    f.geotransform = {500600, 10, 0, 5000000, 0, -10};
    f.at = [](int, int) { return 97.0; };
    const std::string file = make(f, "later.tif");
    EXPECT_EQ(run({"import", database_, file, "--accuracy", "0.05", "--quiet"}).code, 0);
  }
};

using VolumeVerb = Surveys;

TEST_F(VolumeVerb, MeasuresBetweenSurveys) {
  const Json v = json({"volume", database_, "--json", "--before", "plain", "--after", "later", "--extent",
                       "500700", "4999600", "500900", "4999800"});
  EXPECT_NEAR(v["net"].get<double>(), -3 * 200 * 200, 1);
  EXPECT_NEAR(v["cut"]["area"].get<double>(), 200 * 200, 1e-3);
  EXPECT_EQ(v["fill"]["volume"], 0);
  EXPECT_GT(v["error"].get<double>(), 0.149 * 200 * 200);
  EXPECT_LT(v["error"].get<double>(), 0.16 * 200 * 200);
  const Json plane = json({"volume", database_, "--json", "--plane", "90", "--polygon",
                           "500700 4999600, 500900 4999600, 500900 4999800"});
  EXPECT_NEAR(plane["net"].get<double>(), 7 * 20000, 7 * 2500) << "half a square, by pixels of 10 m";
  const Outcome o = run({"volume", database_, "--before", "plain", "--after", "later"});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_SAYS(o.out, "net ");
  EXPECT_EQ(v["step"], 10);
  RasterFile pit{.width = 11, .height = 11};
  pit.geotransform = {500710, 0.25, 0, 4999700, 0, -0.25};
  pit.at = [](int, int) { return 90.0; };
  EXPECT_EQ(run({"import", database_, make(pit, "pit.tif"), "--accuracy", "0.05", "--quiet"}).code, 0);
  Words words{"volume",   database_, "--json",  "--before", "plain",
              "--extent", "500700",  "4999600", "500900",   "4999800"};
  EXPECT_EQ(json(words)["step"], 0.25) << "the best of all there is, which the pit is part of";
  words.insert(words.end(), {"--after", "later"});
  EXPECT_EQ(json(words)["step"], 10) << "it is not compared";
  EXPECT_SAYS(complaint(run({"volume", database_, "--before", "nobody"})), "no grid of this name");
  EXPECT_EQ(run({"volume", database_}).code, 2);
}

using AccuracyVerb = Surveys;

TEST_F(AccuracyVerb, TellsTheBestWhereItIsAndWhoAnswers) {
  const Json a =
      json({"accuracy", database_, "--json", "--extent", "500100", "4999600", "500900", "4999800"});
  EXPECT_NEAR(a["best"]["bound"].get<double>(), 0.05, 0.01);
  EXPECT_GT(a["best"]["at"][0].get<double>(), 500600) << "in the east";
  EXPECT_NEAR(a["worst"]["bound"].get<double>(), 0.1, 0.01);
  EXPECT_NEAR(a["by_grid"]["plain"].get<double>() + a["by_grid"]["later"].get<double>(), 800 * 200, 1);
  EXPECT_EQ(a["area_missing"], 0);
  const std::string map = in_directory("bounds.tif");
  const Outcome o = run({"accuracy", database_, "--map", map});
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_SAYS(o.out, "smallest error available 0.05");
  EXPECT_TRUE(std::filesystem::exists(map));
  // Of a polygon the map has as many pixels as its figures say.
  const Json half = json({"accuracy", database_, "--json", "--map", map, "--polygon",
                          "500700 4999600, 500900 4999600, 500900 4999800"});
  const GDALDatasetUniquePtr d(GDALDataset::Open(map.c_str()));
  ASSERT_TRUE(d);
  const int width = d->GetRasterXSize(), height = d->GetRasterYSize();
  std::vector<float> bounds(std::size_t(width) * std::size_t(height));
  ASSERT_EQ(d->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, bounds.data(), width, height,
                                          GDT_Float32, 0, 0, nullptr),
            CE_None);
  const auto known = std::count_if(bounds.begin(), bounds.end(), [](float b) { return !std::isnan(b); });
  const double pixel = half["step"].get<double>() * half["step"].get<double>();
  EXPECT_NEAR(double(known) * pixel, half["area"].get<double>(), 1e-6);
  EXPECT_LT(known, std::ptrdiff_t(0.7 * double(bounds.size())));
}

}  // namespace patchwork
