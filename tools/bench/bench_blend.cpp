// The blend's evaluators beside each other: the graphics card, the CPU, gdalwarp and the paper's way.
#include <fmt/format.h>
#include <gdal_utils.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "blend/vulkan/vulkan_blend.h"
#include "db/error.h"
#include "db/stopwatch.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"
#include "tools/resampler.h"

namespace patchwork::cli {

namespace {

constexpr double kStep = 10;           // metres, of the base; the surveys have half and a quarter of it
constexpr std::size_t kPatches = 250;  // of the uniform cut
constexpr int kSizes[] = {256, 512, 1024, 2048};
constexpr int kPaperSize = 1024;               // larger ones would take the paper's way minutes
constexpr double kTolerances[] = {1, 10, 50};  // pixels, of the view

struct Closed {
  void operator()(GDALDatasetH d) const { GDALClose(d); }
};
using Dataset = std::unique_ptr<void, Closed>;

struct Contestant {
  std::string name;
  std::function<void()> run;
  int runs;  // measured; one more comes before to warm up
  std::vector<double> seconds = {};
};

// In turns, A B A B: what disturbs the machine disturbs all.
void race(std::vector<Contestant>& all) {
  int most = 0;
  for (const Contestant& c : all) most = std::max(most, c.runs);
  for (int r = 0; r <= most; ++r)
    for (Contestant& c : all) {
      if (r > c.runs) continue;
      const Stopwatch watch;
      c.run();
      if (r > 0) c.seconds.push_back(watch.seconds());
    }
}

// One cut over one raster with one interpolant.
struct Case {
  std::string name;  // e.g. "1024 x 1024, bilinear"
  int size = 0, smoothness = 0;
  const Extraction* cut = nullptr;
  bool peers = true;  // gdalwarp and the paper's way too
};

class BlendBench {
 public:
  explicit BlendBench(const BenchOptions& o) : o_(o), folder_(o), device_(Device::open()) {
    GDALAllRegister();
    make_sources();
    db_ = std::make_unique<Database>(Database::open(folder_.path("blend.pwk")));
    extent_ = db_->extent(), side_ = std::min(extent_.xmax - extent_.xmin, extent_.ymax - extent_.ymin);
    uniform_ = extract_within(*db_, {.patches = kPatches}, 1e4, [](double error) {
                 return make_surface(UniformCut{.error = error});
               }).extraction;
    for (const double tolerance : kTolerances) views_.push_back(extract(*db_, view(tolerance)));
    prefetch(*db_, uniform_.patches, kDefaultMemory);
  }

  std::vector<Work> run() {
    std::vector<Work> works;
    for (const int size : kSizes)
      for (const int k : {0, 2})
        measure({fmt::format("{0} x {0}, {1}", size, k ? "spline" : "bilinear"), size, k, &uniform_}, works);
    for (std::size_t v = 0; v < views_.size(); ++v)
      measure(
          {fmt::format("1024 x 1024, bilinear, view at {} px", kTolerances[v]), 1024, 0, &views_[v], false},
          works);
    return works;
  }

 private:
  // The file that the options name, or a made terrain with two rotated surveys in it.
  void make_sources() {
    std::filesystem::remove(folder_.path("blend.pwk"));
    if (!o_.file.empty()) return add_source(o_.file, 1);
    const double side = (o_.size - 1) * kStep;
    const auto survey = [&](double x, double y, double part, double step, double angle) {
      const double n = std::max(2.0, std::round(part * side / step));
      return fmt::format("{},{},{:.0f},{:.0f},{},{},0.15", x * side, y * side, n, n, step, angle);
    };
    const Json terrain = make_terrain(
        folder_.path("terrain"),
        {"--size", std::to_string(o_.size), "--step", fmt::format("{}", kStep), "--noise", "0.15", "--survey",
         survey(0.3, 0.3, 0.3, kStep / 2, 17), "--survey", survey(0.7, 0.6, 0.2, kStep / 4, -31)});
    for (const auto& f : terrain["files"])
      add_source(folder_.path("terrain/" + std::string(f["file"])), double(f["accuracy"]));
  }

  void add_source(const std::string& path, double accuracy) {
    run_process({own_program("patchwork"), "import", folder_.path("blend.pwk"), path, "--accuracy",
                 fmt::format("{}", accuracy), "--quiet"});
    paths_.push_back(path);
    sources_.emplace_back(GDALOpen(path.c_str(), GA_ReadOnly));
    if (!sources_.back()) throw Error(path, "GDAL cannot open it");
  }

  ViewCut view(double tolerance) const {
    ViewCut v{.eye = {extent_.xmin + 0.1 * side_, extent_.ymin + 0.1 * side_, 0},
              .look = {extent_.xmin + 0.6 * side_, extent_.ymin + 0.6 * side_, 0},
              .pixel_error = tolerance};
    v.look.z = std::max(0.0, db_->heights().highest);
    v.eye.z = v.look.z + 0.05 * side_;
    return over_terrain_of(*db_, v);
  }

  RasterFrame frame(int size) const {
    const double step = side_ / size;
    return {extent_.xmin + 0.5 * step, step, 0, extent_.ymin + side_ - 0.5 * step, 0, -step};
  }

  BlendCounts evaluate(const Evaluator& evaluator, const Case& c, int threads,
                       std::vector<float>& heights) const {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    heights.resize(std::size_t(c.size) * std::size_t(c.size));
    const BlendOutput out{.height = {}, .bound = {}, .source = {}, .patch = {}, .height32 = heights};
    return evaluator.at_pixels(frame(c.size), c.size, 0, c.size, out);
  }

  // What both ways of warping are asked for.
  std::vector<std::string> warp_options(const Case& c) const {
    const std::string size = std::to_string(c.size);
    const auto metres = [](double m) { return fmt::format("{}", m); };
    return {"-q",
            "-r",
            c.smoothness ? "cubicspline" : "bilinear",
            "-te",
            metres(extent_.xmin),
            metres(extent_.ymin),
            metres(extent_.xmin + side_),
            metres(extent_.ymin + side_),
            "-ts",
            size,
            size,
            "-ot",
            "Float32",
            "-multi",
            "-wo",
            fmt::format("NUM_THREADS={}", o_.threads)};
  }

  // The program: it starts, reads the files and writes one.
  void gdalwarp(const Case& c) const {
    std::vector<std::string> command = warp_options(c);
    command.insert(command.begin(), {"gdalwarp", "-overwrite"});
    command.insert(command.end(), paths_.begin(), paths_.end());
    command.push_back(folder_.path("warped.tif"));
    run_process(command, "gdal-bin");
  }

  // The same in this process and to memory, so that neither start nor files count.
  void warp_in_memory(const Case& c) const {
    std::vector<std::string> words = warp_options(c);
    words.insert(words.begin(), {"-of", "MEM"});
    std::vector<char*> arguments;
    for (std::string& w : words) arguments.push_back(w.data());
    arguments.push_back(nullptr);
    GDALWarpAppOptions* options = GDALWarpAppOptionsNew(arguments.data(), nullptr);
    std::vector<GDALDatasetH> in;
    for (const Dataset& d : sources_) in.push_back(d.get());
    const Dataset out(GDALWarp("", nullptr, int(in.size()), in.data(), options, nullptr));
    GDALWarpAppOptionsFree(options);
    if (!out) throw Error("gdalwarp", "it failed");
  }

  Spread rate(const Case& c, const std::vector<double>& seconds) const {
    std::vector<double> rates;
    for (const double s : seconds) rates.push_back(1e-6 * c.size * c.size / s);
    return Spread::of(rates);
  }

  Json shares(const VulkanBlend& card) const {
    const BlockShares s = card.shares();
    const double all = double(s.out + s.inside + s.partial);
    return {{"out", double(s.out) / all},
            {"inside", double(s.inside) / all},
            {"partial", double(s.partial) / all}};
  }

  void measure(const Case& c, std::vector<Work>& works) {
    const BlendOptions options{.smoothness = c.smoothness};
    const VulkanBlend card(device_, *db_, c.cut->patches, options);
    const Blend cpu(*db_, c.cut->patches, options);
    // The paper's way: every sample walks through all patches, weighted, on the same device.
    const VulkanBlend paper(device_, *db_, c.cut->patches,
                            {.smoothness = c.smoothness, .composition = Composition::weighted},
                            {.classify = false, .choose = false});
    std::vector<float> of_card, of_cpu, of_paper;
    BlendCounts counts;
    std::vector<Contestant> all{{"vulkan", [&] { counts = evaluate(card, c, o_.threads, of_card); }, o_.runs},
                                {"cpu", [&] { evaluate(cpu, c, o_.threads, of_cpu); }, o_.runs},
                                {"cpu 1 thread", [&] { evaluate(cpu, c, 1, of_cpu); }, o_.runs}};
    if (c.peers) all.push_back({"gdalwarp in memory", [&] { warp_in_memory(c); }, o_.runs});
    if (c.peers && c.size <= kPaperSize)
      all.push_back({"paper", [&] { evaluate(paper, c, o_.threads, of_paper); }, 1});
    race(all);
    // Not in turn: after a fork every page that this process writes to faults once, which slowed the next
    // ones 4 times.
    if (c.peers) {
      std::vector<Contestant> program{{"gdalwarp", [&] { gdalwarp(c); }, o_.runs}};
      race(program);
      all.push_back(std::move(program[0]));
    }
    const Json answer = answer_of(c, card, counts, of_card, of_cpu);
    for (std::size_t ours = 0; ours < 2; ++ours) {
      Work w{all[ours].name + " " + c.name, "Msamples/s", false, rate(c, all[ours].seconds), {}, answer};
      for (std::size_t k = 0; k < all.size(); ++k)
        if (k != ours) w.peers.emplace_back(all[k].name, rate(c, all[k].seconds));
      works.push_back(std::move(w));
    }
  }

  Json answer_of(const Case& c, const VulkanBlend& card, const BlendCounts& counts,
                 const std::vector<float>& of_card, const std::vector<float>& of_cpu) const {
    double off = 0;
    for (std::size_t k = 0; k < of_cpu.size(); ++k)
      if (of_cpu[k] == of_cpu[k]) off = std::max(off, std::abs(double(of_cpu[k]) - double(of_card[k])));
    const VulkanBlend::Times t = card.times();
    const double n = o_.runs + 1;
    return {{"device", device_->name()},
            {"patches", c.cut->patches.size()},
            {"largest_difference", off},
            {"bound_max", counts.bound_max},
            {"contributors_mean", counts.mean()},
            {"blocks", shares(card)},
            {"exact_share", double(card.exact_points()) / n / double(counts.points)},
            {"ms",
             {{"send", t.send / n},
              {"classify", t.classify / n},
              {"blend", t.blend / n},
              {"exact", t.exact / n},
              {"read_back", t.read_back / n}}}};
  }

  const BenchOptions& o_;
  WorkFolder folder_;
  Extent extent_;
  double side_ = 0;  // metres: of the square that is evaluated
  std::shared_ptr<Device> device_;
  std::vector<std::string> paths_;
  std::vector<Dataset> sources_;
  std::unique_ptr<Database> db_;
  Extraction uniform_;
  std::vector<Extraction> views_;
};

}  // namespace

std::vector<Work> bench_blend(const BenchOptions& options) { return BlendBench(options).run(); }

}  // namespace patchwork::cli
