// One more survey into a database: ours beside a mosaic that is warped into, and beside a rebuilt COG.
#include <fmt/format.h>

#include <map>
#include <set>

#include "db/database.h"
#include "db/error.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

constexpr int kSurveySamples = 1500;
constexpr double kStep = 10, kSurveyStep = 5, kAngle = 30;  // metres, degrees
constexpr int kMostRebuilds = 3;                            // of a COG: each takes as long as the whole

// A base of `size` samples a side in a database and in a mosaic, and a survey that lies in the middle of it.
class Site {
 public:
  Site(const WorkFolder& folder, int size, const BenchOptions& o)
      : folder_(folder), size_(size), threads_(std::to_string(o.threads)) {
    const double middle = 0.5 * kStep * (size - 1);
    const Json terrain =
        make_terrain(path("terrain"),
                     {"--size", std::to_string(size), "--step", fmt::format("{}", kStep), "--type", "Int16",
                      "--scale", "0.1", "--survey",
                      fmt::format("{0},{0},{1},{1},{2},{3},0", middle, kSurveySamples, kSurveyStep, kAngle)});
    const Json report = import_file("base", terrain["files"][0]["accuracy"]);
    import_seconds_ = report["seconds"];
    survey_accuracy_ = terrain["files"][1]["accuracy"];
  }

  /// Seconds to take the survey in; it goes out again, unmeasured.
  double update() {
    const ProcessUse use = run_process(import_command("survey_1", survey_accuracy_));
    report_ = Json::parse(use.output)["grids"][0];
    with_survey_.insert(Database::open(path("db.pwk")).content_hash());
    removed_.push_back(
        run_process({own_program("patchwork"), "remove", path("db.pwk"), "survey_1", "--quiet"}).seconds);
    without_survey_.insert(Database::open(path("db.pwk")).content_hash());
    return use.seconds;
  }

  void make_mosaic() {
    run_process({"gdal_translate", "-q", "-co", "TILED=YES", "-co", "BIGTIFF=YES", path("terrain/base.tif"),
                 mosaic()},
                "gdal-bin");
    overviews();
  }
  double update_in_place() {
    return run_process({"gdalwarp", "-q", "-r", "bilinear", "-multi", "-wo", "NUM_THREADS=" + threads_,
                        path("terrain/survey_1.tif"), mosaic()},
                       "gdal-bin")
               .seconds +
           overviews();
  }
  double rebuild() {
    std::filesystem::remove(path("cog.tif"));
    return run_process(
               {"gdal_translate", "-q", "-of", "COG", "-co", "COMPRESS=ZSTD", "-co", "BIGTIFF=YES", "-co",
                "NUM_THREADS=" + threads_, "-co", "OVERVIEWS=IGNORE_EXISTING", mosaic(), path("cog.tif")},
               "gdal-bin")
        .seconds;
  }

  Json answer() const {
    return {{"size", size_},
            {"patches_added", report_["patches"]},
            {"lowered", report_["lowered"]},
            {"hidden", report_["hidden"]},
            {"stages", report_["stages"]},
            {"remove_seconds", Spread::of(removed_).median},
            {"base_import_seconds", import_seconds_},
            {"one_state_with_survey", with_survey_.size() == 1},
            {"one_state_without", without_survey_.size() == 1}};
  }

 private:
  std::string path(const std::string& name) const { return folder_.path(fmt::format("{}_{}", size_, name)); }
  std::string mosaic() const { return path("mosaic.tif"); }
  double overviews() const {
    return run_process({"gdaladdo", "-q", mosaic(), "2", "4", "8", "16", "32", "64"}, "gdal-bin").seconds;
  }
  std::vector<std::string> import_command(const std::string& name, double accuracy) const {
    return {own_program("patchwork"),
            "import",
            path("db.pwk"),
            path("terrain/" + name + ".tif"),
            "--accuracy",
            fmt::format("{}", accuracy),
            "--threads",
            threads_,
            "--quiet",
            "--json"};
  }
  Json import_file(const std::string& name, double accuracy) const {
    return Json::parse(run_process(import_command(name, accuracy)).output)["grids"][0];
  }

  const WorkFolder& folder_;
  int size_;
  std::string threads_;
  double import_seconds_ = 0, survey_accuracy_ = 0;
  Json report_;
  std::set<std::string> with_survey_, without_survey_;
  std::vector<double> removed_;
};

}  // namespace

std::vector<Work> bench_update(const BenchOptions& o) {
  const WorkFolder folder(o);
  std::map<int, Site> sites;
  for (const int size : {1025, 4097, 16385})
    if (size <= o.size) sites.try_emplace(size, folder, size, o);
  if (sites.empty()) throw Error("size", "it must be at least 1025", "the survey needs the room");
  Site& largest = sites.rbegin()->second;
  largest.make_mosaic();
  std::map<int, std::vector<double>> seconds;
  std::vector<double> in_place, rebuilt;
  for (int run = 0; run <= o.runs; ++run) {
    for (auto& [size, site] : sites) {
      const double s = site.update();
      if (run > 0) seconds[size].push_back(s);
    }
    const double s = largest.update_in_place();
    if (run > 0) in_place.push_back(s);
    if (run > 0 && run <= kMostRebuilds) rebuilt.push_back(largest.rebuild());
  }
  std::vector<Work> works;
  for (auto site = sites.rbegin(); site != sites.rend(); ++site) {
    Work w{fmt::format("survey of {0} x {0} into {1} x {1}", kSurveySamples, site->first),
           "s",
           true,
           Spread::of(seconds[site->first]),
           {},
           site->second.answer()};
    if (site == sites.rbegin())
      w.peers = {{"in place", Spread::of(in_place)}, {"COG rebuild", Spread::of(rebuilt)}};
    works.push_back(std::move(w));
  }
  return works;
}

}  // namespace patchwork::cli
