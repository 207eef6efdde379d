// Building levels from one grid: ours beside GDAL's Cloud Optimized GeoTIFF.
#include <fmt/format.h>

#include <algorithm>

#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

constexpr const char* kPeer = "COG ZSTD";

// What the runs gathered, one element a run.
struct Figures {
  std::vector<double> seconds, peak_mib, bytes_per_sample;
  void add(const ProcessUse& use, double bytes) {
    seconds.push_back(use.seconds), peak_mib.push_back(use.peak_mib), bytes_per_sample.push_back(bytes);
  }
};

class ImportBench {
 public:
  explicit ImportBench(const BenchOptions& o) : o_(o), folder_(o) {
    accuracy_ = make("terrain", o.size)["files"][0]["accuracy"];
    make("quarter", std::max(2, (o.size - 1) / 4 + 1));
    source_ = folder_.path("terrain/base.tif"), quarter_ = folder_.path("quarter/base.tif");
  }

  std::vector<Work> run() {
    ours(source_), peer();
    for (int r = 0; r < o_.runs; ++r) {
      const double quarter = ours(quarter_).peak_mib;
      add_ours(ours(source_), quarter), peer_.add(peer(), bytes_a_sample(cog()));
    }
    return works();
  }

 private:
  Json make(const std::string& name, int size) const {
    return make_terrain(folder_.path(name),
                        {"--size", std::to_string(size), "--type", "Int16", "--scale", "0.1"});
  }
  std::string database() const { return folder_.path("new.pwk"); }
  std::string cog() const { return folder_.path("out.tif"); }
  double samples() const { return double(o_.size) * o_.size; }
  double bytes_a_sample(const std::string& file) const {
    return double(std::filesystem::file_size(file)) / samples();
  }

  ProcessUse ours(const std::string& source) {
    for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::remove(database() + suffix);
    return run_process({own_program("patchwork"), "import", database(), source, "--accuracy",
                        fmt::format("{}", accuracy_), "--threads", std::to_string(o_.threads), "--quiet",
                        "--json"});
  }
  ProcessUse peer() {
    std::filesystem::remove(cog());
    return run_process({"gdal_translate", "-q", "-of", "COG", "-co", "COMPRESS=ZSTD", "-co",
                        "NUM_THREADS=" + std::to_string(o_.threads), "-co", "OVERVIEWS=AUTO", source_, cog()},
                       "gdal-bin");
  }
  void add_ours(const ProcessUse& use, double quarter_mib) {
    ours_.add(use, bytes_a_sample(database()));
    growth_.push_back(use.peak_mib / quarter_mib);
    report_ = Json::parse(use.output)["grids"][0];
    errors_.push_back(double(report_["stages"]["errors"]) * o_.threads);
  }

  std::vector<Work> works() const {
    const std::string what = fmt::format("import {0} x {0} Int16", o_.size);
    const Json answer{{"patches", report_["patches"]},
                      {"file_bytes", std::filesystem::file_size(database())},
                      {"sample_bytes", std::uint64_t(2 * samples())},
                      {"peer_bytes", std::filesystem::file_size(cog())},
                      {"stages", report_["stages"]}};
    return {{what, "s", true, Spread::of(ours_.seconds), {{kPeer, Spread::of(peer_.seconds)}}, answer},
            {what + ", peak memory",
             "MiB",
             true,
             Spread::of(ours_.peak_mib),
             {{kPeer, Spread::of(peer_.peak_mib)}},
             answer},
            {what + ", peak memory over that of a quarter of its side",
             "ratio",
             true,
             Spread::of(growth_),
             {},
             answer},
            {what + ", file",
             "bytes/sample",
             true,
             Spread::of(ours_.bytes_per_sample),
             {{kPeer, Spread::of(peer_.bytes_per_sample)}},
             answer},
            {what + ", errors of all levels", "s a core", true, Spread::of(errors_), {}, answer}};
  }

  const BenchOptions& o_;
  WorkFolder folder_;
  double accuracy_ = 0;
  std::string source_, quarter_;  // a quarter: along each side
  Figures ours_, peer_;
  std::vector<double> errors_, growth_;
  Json report_;
};

}  // namespace

std::vector<Work> bench_import(const BenchOptions& options) { return ImportBench(options).run(); }

}  // namespace patchwork::cli
