// A mosaic of five grids, four of them rotated: ours beside gdalwarp.
#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <cmath>

#include "db/stopwatch.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"
#include "tools/bench/truth_check.h"
#include "tools/resampler.h"

namespace patchwork::cli {

namespace {

constexpr double kStep = 2.5;         // metres of a pixel
constexpr double kNoise = 0.15;       // metres, on every sample
constexpr int kTruthStride = 7;       // pixels; a divisor of no pyramid step
constexpr int kEvaluationRows = 512;  // as write_cog asks for them

struct Program {
  std::string name, resampling;  // resampling: empty for ours
  std::vector<double> seconds, peak_mib;
  std::string out;
  TruthFigures truth;
};

class ResampleBench {
 public:
  explicit ResampleBench(const BenchOptions& o) : o_(o), folder_(o), pixels_(o.size - 1) {
    programs_ = {{"ours", "", {}, {}, folder_.path("ours.tif"), {}},
                 {"gdalwarp bilinear", "bilinear", {}, {}, folder_.path("bilinear.tif"), {}},
                 {"gdalwarp cubic", "cubic", {}, {}, folder_.path("cubic.tif"), {}}};
    make_sources();
    build_database();
  }

  std::vector<Work> run() {
    for (int r = 0; r <= o_.runs; ++r)
      for (Program& p : programs_) {
        const ProcessUse use = one(p);
        if (r > 0) p.seconds.push_back(use.seconds), p.peak_mib.push_back(use.peak_mib);
      }
    // From here on this process grows, which would show in the children's peaks.
    evaluate();
    compare();
    return works();
  }

 private:
  double side() const { return pixels_ * kStep; }

  // The base has half the raster's density, the surveys its own and more; the finest comes last, as gdalwarp
  // lets the last file win.
  void make_sources() {
    const double s = side();
    const auto survey = [&](double x, double y, double w, double h, double step, double angle) {
      return fmt::format("{},{},{:.0f},{:.0f},{},{},{}", x * s, y * s, std::max(2., std::round(w * s / step)),
                         std::max(2., std::round(h * s / step)), step, angle, kNoise);
    };
    terrain_ = make_terrain(
        folder_.path("terrain"),
        {"--size", std::to_string(pixels_ / 2 + 1), "--step", fmt::format("{}", 2 * kStep), "--noise",
         fmt::format("{}", kNoise), "--survey", survey(0.27, 0.27, 0.34, 0.34, kStep, 17), "--survey",
         survey(0.71, 0.25, 0.32, 0.36, kStep, -31), "--survey", survey(0.72, 0.72, 0.39, 0.29, kStep, 63),
         "--survey", survey(0.49, 0.51, 0.23, 0.23, 2, 45)});
  }

  void build_database() {
    for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::remove(database() + suffix);
    for (const auto& f : terrain_["files"])
      run_process({own_program("patchwork"), "import", database(), source(f), "--accuracy",
                   fmt::format("{}", double(f["accuracy"])), "--quiet"});
  }
  std::string database() const { return folder_.path("mosaic.pwk"); }
  std::string source(const Json& file) const { return folder_.path("terrain/" + std::string(file["file"])); }

  ProcessUse one(const Program& p) {
    std::filesystem::remove(p.out);
    return p.resampling.empty() ? ours(p.out, "height") : gdalwarp(p);
  }
  ProcessUse ours(const std::string& out, const std::string& bands) {
    const std::string s = fmt::format("{}", side());
    return run_process({own_program("patchwork"), "resample", database(), out, "--error", "0", "--extent",
                        "0", "0", s, s, "--step", fmt::format("{}", kStep), "--bands", bands, "--threads",
                        std::to_string(o_.threads), "--quiet"});
  }
  ProcessUse gdalwarp(const Program& p) {
    const std::string s = fmt::format("{}", side()), step = fmt::format("{}", kStep);
    std::vector<std::string> command{"gdalwarp",
                                     "-q",
                                     "-r",
                                     p.resampling,
                                     "-multi",
                                     "-wo",
                                     "NUM_THREADS=" + std::to_string(o_.threads),
                                     "-te",
                                     "0",
                                     "0",
                                     s,
                                     s,
                                     "-tr",
                                     step,
                                     step,
                                     "-ot",
                                     "Float32"};
    for (const auto& f : terrain_["files"]) command.push_back(source(f));
    command.push_back(p.out);
    return run_process(command, "gdal-bin");
  }

  // The surface alone: patches are at hand, heights stay in memory.
  void evaluate() {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(o_.threads));
    const Database db = Database::open(database());
    const Extent extent{0, 0, side(), side()};
    const Raster raster = Raster::covering(extent, kStep);
    const Extraction x = extract(db, {.error = 0, .region = Region::inside(extent)});
    prefetch(db, x.patches, kDefaultMemory);
    const Blend blend(db, x.patches, {});
    Resampler resampler(blend, raster, {"height"}, 0);  // rows as they are asked for, each time
    std::vector<float> rows(size_t(raster.width) * size_t(kEvaluationRows));
    for (int r = 0; r <= o_.runs; ++r) {
      const Stopwatch watch;
      for (int row = 0; row < raster.height; row += kEvaluationRows) {
        float* const band = rows.data();
        resampler.rows(1, row, std::min(kEvaluationRows, raster.height - row), {&band, 1});
      }
      if (r > 0) evaluation_.push_back(watch.seconds());
    }
    patches_ = x.patches.size();
    contributors_ = resampler.tally().full.mean();
  }

  void compare() {
    const TerrainFunction truth({.extent = {0, 0, side(), side()}});
    for (Program& p : programs_) p.truth = compare_with_truth(p.out, truth, kTruthStride);
    const std::string bounded = folder_.path("bounded.tif");
    ours(bounded, "height,bound");
    bounded_ = compare_with_truth(bounded, truth, kTruthStride);
  }

  Spread rate(const std::vector<double>& seconds) const {
    std::vector<double> rates;
    for (const double s : seconds) rates.push_back(1e-6 * pixels_ * pixels_ / s);
    return Spread::of(rates);
  }
  Work work(const std::string& name, const std::string& unit, bool lower, const auto& spread_of) const {
    Work w{name, unit, lower, spread_of(programs_.front()), {}, {}};
    for (std::size_t p = 1; p < programs_.size(); ++p)
      w.peers.emplace_back(programs_[p].name, spread_of(programs_[p]));
    return w;
  }
  std::vector<Work> works() const {
    const std::string what = fmt::format("resample 5 grids to {0} x {0} Float32", pixels_);
    std::vector<Work> all{
        work(what, "s", true, [](const Program& p) { return Spread::of(p.seconds); }),
        work(what + ", rate", "Mpx/s", false, [&](const Program& p) { return rate(p.seconds); }),
        work(what + ", peak memory", "MiB", true, [](const Program& p) { return Spread::of(p.peak_mib); }),
        work(what + ", evaluation alone", "Mpx/s", false,
             [&](const Program& p) { return rate(p.resampling.empty() ? evaluation_ : p.seconds); }),
        work(what + ", rms against the truth", "m", true, [](const Program& p) {
          return Spread{p.truth.rms, p.truth.rms, p.truth.rms};
        })};
    Json answer{{"patches", patches_}, {"contributors_mean", contributors_}};
    for (const Program& p : programs_) answer["truth"][p.name] = p.truth.json();
    answer["beyond_the_bound"] = bounded_.beyond_the_bound;
    answer["within_the_bound"] = 1 - double(bounded_.beyond_the_bound) / double(bounded_.pixels);
    for (Work& w : all) w.answer = answer;
    return all;
  }

  const BenchOptions& o_;
  WorkFolder folder_;
  int pixels_;
  Json terrain_;
  std::vector<Program> programs_;
  std::vector<double> evaluation_;
  std::size_t patches_ = 0;
  double contributors_ = 0;
  TruthFigures bounded_;
};

}  // namespace

std::vector<Work> bench_resample(const BenchOptions& options) { return ResampleBench(options).run(); }

}  // namespace patchwork::cli
