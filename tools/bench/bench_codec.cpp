// Samples of all levels in bytes and back: ours beside LERC and zstd, one core.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "db/error.h"
#include "db/raster.h"
#include "db/stopwatch.h"
#include "tools/bench/bench.h"
#include "tools/bench/pyramid_coder.h"

namespace patchwork::cli {

namespace {

constexpr double kTolerances[] = {0, 0.1, 0.5, 1};  // metres
constexpr int kTopSide = 113;                       // samples; no level follows one of this size

class CodecBench {
 public:
  explicit CodecBench(const BenchOptions& o) : o_(o) {
    std::string file = o.file;
    std::optional<WorkFolder> folder;
    if (file.empty()) {
      folder.emplace(o);
      make_terrain(folder->path("terrain"),
                   {"--size", std::to_string(o.size), "--type", "Int16", "--scale", "0.1"});
      file = folder->path("terrain/base.tif");
    }
    read(file);
  }

  std::vector<Work> run() {
    std::vector<Work> works;
    for (const double metres : kTolerances) {
      const int tolerance = int(std::floor(metres / unit_ + 1e-9));
      if (metres > 0 && tolerance == 0) continue;  // the file is coarser than that
      const std::vector<std::unique_ptr<Coder>> coders = make_coders();
      for (int r = 0; r <= o_.runs; ++r)
        for (const auto& c : coders) measure(*c, tolerance, r > 0);
      add_works(metres > 0 ? fmt::format("{} m", metres) : "lossless", coders, works);
    }
    return works;
  }

 private:
  void read(const std::string& file) {
    const RasterSource source = RasterSource::open(file, {}, "");
    if (!source.integer_samples()) throw Error(file, "its samples are not integers");
    unit_ = std::abs(source.scale());
    Level level{source.width(), source.height(), {}};
    std::vector<double> raw(std::size_t(level.cols) * std::size_t(level.rows));
    source.read_rows(0, level.rows, std::span<double>(raw));
    for (const double v : raw) level.samples.push_back(std::isnan(v) ? 0 : std::int32_t(v));
    pyramid_.push_back(std::move(level));
    while (std::max(pyramid_.back().cols, pyramid_.back().rows) > kTopSide)
      pyramid_.push_back(decimated(pyramid_.back()));
  }

  static Level decimated(const Level& fine) {
    Level l{(fine.cols + 1) / 2, (fine.rows + 1) / 2, {}};
    for (int y = 0; y < fine.rows; y += 2)
      for (int x = 0; x < fine.cols; x += 2)
        l.samples.push_back(fine.samples[std::size_t(y) * std::size_t(fine.cols) + std::size_t(x)]);
    return l;
  }

  double samples() const {
    double sum = 0;
    for (const Level& l : pyramid_) sum += double(l.samples.size());
    return sum;
  }

  void measure(Coder& coder, int tolerance, bool keep) const {
    const auto speed = [&](const Stopwatch& watch) { return samples() / (1e6 * watch.seconds()); };
    const Stopwatch encoding;
    coder.encode(pyramid_, tolerance);
    const double encoded = speed(encoding);
    Pyramid out = pyramid_;
    for (Level& l : out) std::fill(l.samples.begin(), l.samples.end(), 0);
    const Stopwatch decoding;
    coder.decode(out);
    const double decoded = speed(decoding);
    if (keep) coder.encoded.push_back(encoded), coder.decoded.push_back(decoded);
    check(coder, out, tolerance);
  }

  void check(Coder& coder, const Pyramid& out, int tolerance) const {
    for (std::size_t l = 0; l < out.size(); ++l)
      for (std::size_t i = 0; i < out[l].samples.size(); ++i)
        coder.error =
            std::max(coder.error, std::abs(double(out[l].samples[i]) - double(pyramid_[l].samples[i])));
    if (coder.error > tolerance) throw Error(coder.name, "it exceeds the tolerance");
  }

  void add_works(const std::string& tolerance, const std::vector<std::unique_ptr<Coder>>& coders,
                 std::vector<Work>& works) const {
    const double base = double(pyramid_[0].samples.size());
    Json errors;
    for (const auto& c : coders) errors[c->name] = c->error * unit_;
    const Json answer{{"levels", pyramid_.size()}, {"samples", samples()}, {"largest_error", errors}};
    const auto add = [&](const std::string& what, const std::string& unit, bool lower, auto figures) {
      Work w{
          fmt::format("all levels, {}, {}", tolerance, what), unit, lower, figures(*coders[0]), {}, answer};
      for (std::size_t k = 1; k < coders.size(); ++k)
        w.peers.emplace_back(coders[k]->name, figures(*coders[k]));
      works.push_back(std::move(w));
    };
    add("size", "bytes/sample of level 0", true,
        [&](const Coder& c) { return Spread::of({c.bytes() / base}); });
    works.back().peers.emplace_back("16 bits", Spread::of({2 * samples() / base}));
    add("encoding", "M samples/s a core", false, [](const Coder& c) { return Spread::of(c.encoded); });
    add("decoding", "M samples/s a core", false, [](const Coder& c) { return Spread::of(c.decoded); });
  }

  const BenchOptions& o_;
  double unit_ = 1;  // metres
  Pyramid pyramid_;
};

}  // namespace

std::vector<Work> bench_codec(const BenchOptions& options) { return CodecBench(options).run(); }

}  // namespace patchwork::cli
