// Each verb from the outside: exit codes, which stream carries what, and the keys that programs read.
#include <signal.h>

#include "tests/cli/command.h"

namespace patchwork {

namespace {

const Words kVerbs{"import",  "list",  "info",     "query",  "sample", "resample",
                   "profile", "sight", "accuracy", "volume", "view"};

std::vector<std::string> missing_keys(const Json& document, const Words& keys) {
  std::vector<std::string> missing;
  for (const std::string& k : keys)
    if (!document.contains(k)) missing.push_back(k);
  return missing;
}

}  // namespace

using Verbs = CliTest;

TEST_F(Verbs, EachExplainsItself) {
  for (const std::string& verb : kVerbs) {
    const Outcome o = run({verb, "--help"});
    EXPECT_EQ(o.code, 0) << verb;
    EXPECT_SAYS(o.out, "DB");
    EXPECT_SAYS(o.out, "--memory");
    EXPECT_EQ(o.err, "");
  }
  const Outcome all = run({"--help"});
  EXPECT_EQ(all.code, 0);
  for (const std::string& verb : kVerbs) EXPECT_SAYS(all.out, verb);
  EXPECT_EQ(run({"--version"}).code, 0);
}

TEST_F(Verbs, WrongUsageExitsWithTwo) {
  const std::string db = hill_database(), tif = in_directory("hills.tif"), out = in_directory("out.tif");
  const std::vector<Words> wrong{
      {},
      {"fly", db},
      {"import", db},
      {"import", db, tif, "--unit", "cubits"},
      {"import", db, tif, "--accuracy", "good"},
      {"import", db, tif, tif, "--name", "one"},
      {"info"},
      {"info", db, "--jsno"},
      {"query", db},
      {"query", db, "--error", "1", "--extent", "0", "0", "1"},
      {"sample", db, "--smoothness", "3"},
      {"sample", db, "--blend", "mixed"},
      {"sample", db, "--memory", "much"},
      {"resample", db, out, "--bands", "colour"},
      {"resample", db, out, "--step", "0"},
      {"query", db, "--eye", "0", "0", "9", "--look", "9", "0", "0", "--size", "1e300", "720"},
      {"list", db, "--threads", "-1"}};
  for (const Words& words : wrong) {
    const Outcome o = run(words);
    EXPECT_EQ(o.code, 2) << Json(words).dump();
    EXPECT_EQ(o.out, "") << Json(words).dump();
    EXPECT_NE(o.err, "") << Json(words).dump();
  }
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(run({"query", db, "--error", "1", "--extent", "-1", "-2", "1", "2"}).code, 0)
      << "the same, right";
  EXPECT_EQ(run({"list", db, "--threads", "1", "--memory", "64MiB"}).code, 0);
}

TEST_F(Verbs, NumbersOutOfTheirRangeAreWrongUsage) {
  const std::string db = hill_database(), out = in_directory("out.tif");
  for (const Words& words : {Words{"query", db, "--error"}, Words{"query", db, "--patches"},
                             Words{"sample", db, "--error"}, Words{"resample", db, out, "--step"}}) {
    const auto with = [&](const char* number) {
      Words all = words;
      all.push_back(number);
      return run(all);
    };
    for (const char* number : {"-5", "nan", "inf", "1e999"}) {
      const Outcome o = with(number);
      EXPECT_EQ(o.code, 2) << Json(words).dump() << number;
      EXPECT_SAYS(o.err, words.back() + ": it must be");
    }
    EXPECT_EQ(with("5").code, 0) << Json(words).dump() << ", negative control";
  }
  // Numbers of either sign.
  const Words ray{"sight", db, "--from", "500105", "4999895", "2", "--to", "500305", "4999795", "2"};
  for (const auto& [words, option] : {std::pair{Words{"volume", db}, "--plane"}, {ray, "--refraction"}})
    for (const char* number : {"nan", "inf", "-5"}) {
      Words all = words;
      all.insert(all.end(), {option, number});
      const bool good = number[0] == '-';
      const Outcome o = run(all);
      EXPECT_EQ(o.code, good ? 0 : 2) << Json(all).dump() << o.err;
      if (!good) {
        EXPECT_SAYS(o.err, std::string(option) + ": it must be a number");
      }
    }
}

// What a script gives whose variable is not set.
TEST_F(Verbs, AnEmptyNameOrPlaceIsNoneAtAll) {
  const std::string db = hill_database(), tif = in_directory("hills.tif");
  EXPECT_SAYS(complaint(run({"volume", db, "--plane", "0", "--polygon", ""})), "polygon");
  EXPECT_SAYS(complaint(run({"query", db, "--error", "1", "--polygon", ""})), "polygon");
  EXPECT_EQ(run({"import", db, tif, "--replace", ""}).code, 2);
}

TEST_F(Verbs, ImportTellsProgramsWhatItDid) {
  const std::string file = make(hill_file()), db = in_directory("new.pwk");
  const Outcome o = run({"import", db, file, "--json"});
  ASSERT_EQ(o.code, 0) << o.err;
  const Json document = Json::parse(o.out);
  ASSERT_EQ(document.at("grids").size(), 1u);
  const Json& g = document["grids"][0];
  EXPECT_EQ(missing_keys(g, {"name", "accuracy", "patches", "seconds", "warnings"}), Words{});
  EXPECT_EQ(g["name"], "grid");
  EXPECT_DOUBLE_EQ(g["accuracy"].get<double>(), 0.2) << "2 % of a step of 10 m";
  ASSERT_EQ(g["warnings"].size(), 1u);
  EXPECT_SAYS(g["warnings"][0].get<std::string>(), "no accuracy given");
  EXPECT_SAYS(o.err, "no accuracy given");
  EXPECT_EQ(o.out.find("no accuracy given") != std::string::npos, true) << "in the document alone";
  EXPECT_EQ(missing_keys(g, {"nonsense"}), Words{"nonsense"}) << "the check can fail";
}

TEST_F(Verbs, InfoHasTheKeysThatProgramsRelyOn) {
  const std::string db = hill_database();
  const Json info = json({"info", db, "--json"});
  EXPECT_EQ(missing_keys(info, {"version", "content_hash", "crs", "extent", "grids", "patches", "dormant",
                                "levels", "file_bytes", "sample_bytes", "tree", "coverage_decided_by"}),
            Words{});
  const Json& g = info["grids"].at(0);
  EXPECT_EQ(missing_keys(g, {"name", "accuracy", "width", "height", "angle_degrees", "step"}), Words{});
  EXPECT_EQ(g["name"], "hills");
  EXPECT_EQ(g["width"], 60);
  EXPECT_EQ(g["height"], 50);
  EXPECT_EQ(g["step"], Json({10.0, 10.0}));
  EXPECT_EQ(g["accuracy"], 0.1);
  EXPECT_EQ(missing_keys(info["tree"], {"height", "nodes", "fill"}), Words{});
  EXPECT_EQ(missing_keys(info["coverage_decided_by"], {"integer", "interval", "exact"}), Words{});
  const double want[] = {500000, 4999500, 500600, 5000000};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(info["extent"][k].get<double>(), want[k], 1e-6);
  std::size_t by_level = 0;
  for (const auto& [level, n] : info["levels"].items()) by_level += n.get<std::size_t>();
  EXPECT_EQ(by_level, info["patches"].get<std::size_t>());
  EXPECT_EQ(info["sample_bytes"], 60 * 50 * 4);
  EXPECT_EQ(json({"list", db, "--json"})["grids"][0]["name"], "hills");
  for (const char* verb : {"info", "list"}) {
    const Outcome o = run({verb, db});
    EXPECT_EQ(o.code, 0);
    EXPECT_EQ(o.err, "");
    EXPECT_SAYS(o.out, "hills");
  }
}

TEST_F(Verbs, QueryHasTheKeysThatProgramsRelyOn) {
  const std::string db = hill_database();
  const Json q = json({"query", db, "--error", "0.5", "--list", "--json"});
  EXPECT_EQ(missing_keys(q, {"patches", "by_level", "by_grid", "bound_max", "bound_inside", "error_available",
                             "cost"}),
            Words{});
  const Json nothing =
      json({"query", db, "--error", "0", "--extent", "0", "0", "1", "1", "--list", "--json"});
  EXPECT_EQ(nothing["list"], Json::array());
  EXPECT_EQ(missing_keys(q["cost"], {"nodes", "boxes", "patches", "bytes", "seconds"}), Words{});
  const auto n = q["patches"].get<std::size_t>();
  EXPECT_GT(n, 0u);
  EXPECT_EQ(q["by_grid"]["hills"].get<std::size_t>(), n);
  EXPECT_EQ(q["list"].size(), n);
  EXPECT_EQ(json({"query", db, "--error", "0", "--extent", "0", "0", "1", "1", "--json"})["patches"], 0);
  const Json coarse = json({"query", db, "--error", "1000", "--json"});
  EXPECT_LT(coarse["patches"].get<std::size_t>(),
            json({"query", db, "--error", "0", "--json"})["patches"].get<std::size_t>());
  EXPECT_EQ(json({"query", db, "--error", "0", "--polygon", "500100 4999700, 500200 4999700, 500200 4999800",
                  "--json"})["by_grid"]
                .size(),
            1u);
}

TEST_F(Verbs, ACorridorNeedsMoreThanItsSurroundings) {
  const std::string db = hill_database();
  const auto patches = [&](const Words& options) {
    Words words{"query", db, "--json"};
    words.insert(words.end(), options.begin(), options.end());
    return json(words)["patches"].get<int>();
  };
  const Words line{"--corridor", "LINESTRING (500050 4999950, 500250 4999700)", "--error", "0.2", "--outside",
                   "50"};
  const auto with = [&](Words more) {
    more.insert(more.begin(), line.begin(), line.end());
    return more;
  };
  const int narrow = patches(line), wide = patches(with({"--width", "60", "--ramp", "100"}));
  EXPECT_GT(narrow, patches({"--error", "50"}));
  EXPECT_LE(narrow, wide);
  EXPECT_EQ(patches(with({"--width", "1e6"})), patches({"--error", "0.2"})) << "all of it is in the corridor";
  EXPECT_EQ(run({"query", db, "--corridor", "0 0, 1 1", "--error", "1"}).code, 2);
  EXPECT_EQ(run({"query", db, "--error", "1", "--outside", "3"}).code, 2);
  EXPECT_EQ(run({"query", db, "--error", "1", "--width", "3"}).code, 2);
  EXPECT_SAYS(complaint(run({"query", db, "--corridor", "0 0", "--error", "1", "--outside", "3"})),
              "two points");
}

TEST_F(Verbs, RenderTessellatesAsItIsTold) {
  const std::string db = hill_database();
  const auto draw = [&](const std::string& way) {
    const std::string out = in_directory("way" + way + ".png");
    Words words{"render", db, out, "--size", "160", "90", "--json"};
    if (!way.empty()) words.insert(words.end(), {"--tessellation", way});
    const Outcome o = run(words);
    EXPECT_EQ(o.code, 0) << o.err;
    return Json::parse(o.out)["tessellation"].get<std::string>();
  };
  for (const char* way : {"hardware", "mesh", "published"}) EXPECT_EQ(draw(way), way);
  EXPECT_EQ(draw(""), "hardware") << "a single picture, whatever the device";
  EXPECT_EQ(run({"render", db, in_directory("x.png"), "--tessellation", "skirts"}).code, 2);
}

TEST_F(Verbs, QuietSaysNothing) {
  const std::string file = make(hill_file()), quiet = in_directory("quiet.pwk"),
                    loud = in_directory("loud.pwk");
  const Outcome import = run({"import", quiet, file, "--quiet"});
  EXPECT_EQ(import.code, 0);
  EXPECT_EQ(import.out + import.err, "");
  const Outcome resample = run({"resample", quiet, in_directory("q.tif"), "--quiet"});
  EXPECT_EQ(resample.code, 0);
  EXPECT_EQ(resample.out + resample.err, "");
  const Outcome sample = run({"sample", quiet, "--quiet"}, {.input = "500100 4999900\n"});
  EXPECT_EQ(lines_of(sample.out).size(), 1u);
  EXPECT_EQ(sample.err, "");
  const Outcome spoken = run({"import", loud, file});
  EXPECT_NE(spoken.out, "");
  EXPECT_NE(spoken.err, "");
  EXPECT_EQ(spoken.err.find('\r'), std::string::npos) << "no progress bar where no terminal is";
  const Outcome failure = run({"info", in_directory("none.pwk"), "--quiet"});
  EXPECT_SAYS(complaint(failure), "no such database") << "quiet hides no failure";
}

TEST_F(Verbs, AReaderThatLeavesEndsTheStreamSilently) {
  const std::string db = hill_database();
  std::string points;
  for (int k = 0; k < 20000; ++k) points += "500100 4999900\n";
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  close(pipe_ends[0]);
  const Outcome o = run({"sample", db, "--quiet"}, {.input = points, .in_child = [&] {
                                                      signal(SIGPIPE, SIG_DFL);
                                                      dup2(pipe_ends[1], STDOUT_FILENO);
                                                    }});
  close(pipe_ends[1]);
  EXPECT_EQ(o.signal, SIGPIPE) << o.code;
  EXPECT_EQ(o.err, "");
}

TEST_F(Verbs, AFullDiskBehindStdoutIsAFailure) {
  const std::string db = hill_database();
  const Circumstances full{.input = "500100 4999900\n", .output = "/dev/full"};
  EXPECT_SAYS(complaint(run({"info", db, "--json"}, full)), "standard output");
  EXPECT_SAYS(complaint(run({"info", db}, full)), "standard output");
  EXPECT_SAYS(complaint(run({"sample", db, "--quiet"}, full)), "standard output");
  EXPECT_EQ(run({"info", db, "--json"}, {.output = "/dev/null"}).code, 0);
}

}  // namespace patchwork
