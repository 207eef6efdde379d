// patchwork sample: points in, heights and their bounds out, any number, as a stream.
#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "db/error.h"
#include "tools/cli.h"
#include "tools/number_lines.h"

namespace patchwork::cli {

namespace {

constexpr std::size_t kBatch = 1 << 18;  // points evaluated together
constexpr std::size_t kPiece = 4096;     // lines written by one thread

struct Options {
  std::string database;
  SurfaceOptions surface;
};

class Sampler {
 public:
  Sampler(const Database& db, const Options& o, std::uint64_t memory)
      : db_(db),
        patches_(extract(db, {.error = o.surface.error, .strict = o.surface.strict}).patches),
        blend_(make_evaluator(db, patches_, o.surface, memory)) {}

  void read(std::istream& in) {
    NumberLines lines(in, {{"x", "easting"}, {"y", "northing"}});
    for (double point[2]; lines.next(point);) {
      x_.push_back(point[0]), y_.push_back(point[1]);
      if (x_.size() == kBatch) flush();
    }
    flush();
  }

  /// How many points there were, and how many patches were read for one.
  std::string summary() const {
    return fmt::format("{} point{} from {} patches on {}; {:.3f} patches read a point, {} at most",
                       counts_.points, counts_.points == 1 ? "" : "s", patches_.size(), engine_name(*blend_),
                       counts_.mean(), counts_.most);
  }

 private:
  void flush() {
    height_.resize(x_.size()), bound_.resize(x_.size()), source_.resize(x_.size());
    counts_ +=
        blend_->at_points(x_, y_, {.height = height_, .bound = bound_, .source = source_, .patch = {}});
    std::vector<fmt::memory_buffer> pieces((x_.size() + kPiece - 1) / kPiece);
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t n) {
      for (std::size_t k = n * kPiece; k < std::min(x_.size(), (n + 1) * kPiece); ++k) write(k, pieces[n]);
    });
    bool good = true;
    for (const fmt::memory_buffer& out : pieces)
      good = good && std::fwrite(out.data(), 1, out.size(), stdout) == out.size();
    if (!good || std::fflush(stdout) != 0)
      throw Error("standard output", "it cannot be written", "is the disk full?");
    x_.clear(), y_.clear();
  }
  void write(std::size_t k, fmt::memory_buffer& out) const {
    if (source_[k] == 0) {  // whatever sign these have
      fmt::format_to(std::back_inserter(out), "{} {} nan nan -\n", x_[k], y_[k]);
      return;
    }
    fmt::format_to(std::back_inserter(out), "{} {} {} {} {}\n", x_[k], y_[k], height_[k], bound_[k],
                   source_name(db_, source_[k]));
  }

  const Database& db_;
  std::vector<PatchId> patches_;
  std::unique_ptr<Evaluator> blend_;
  std::vector<double> x_, y_, height_, bound_;
  std::vector<std::int32_t> source_;
  BlendCounts counts_;
};

}  // namespace

void add_sample(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v =
      verb(app, common, "sample", "heights at points: lines \"x y\" in, \"x y height bound grid\" out");
  v->add_option("DB", o->database, "the database")->required();
  o->surface.add_to(*v);
  v->callback([o, &common] {
    const Database db = Database::open(o->database, common.memory);
    std::ios::sync_with_stdio(false);
    Sampler sampler(db, *o, common.memory);
    sampler.read(std::cin);
    note(common, sampler.summary());
  });
}

}  // namespace patchwork::cli
