// patchwork sample: points in, heights and their bounds out, any number, as a stream.
#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <iostream>
#include <string_view>

#include "db/error.h"
#include "tools/cli.h"

namespace patchwork::cli {

namespace {

constexpr std::size_t kBatch = 1 << 18;  // points evaluated together

struct Options {
  std::string database;
  SurfaceOptions surface;
};

constexpr std::string_view kBlanks = " \t\r,;";

std::string_view next_token(std::string_view& line) {
  const std::size_t from = line.find_first_not_of(kBlanks);
  if (from == std::string_view::npos) return line = {}, std::string_view();
  const std::size_t to = std::min(line.find_first_of(kBlanks, from), line.size());
  const std::string_view token = line.substr(from, to - from);
  line.remove_prefix(to);
  return token;
}

bool parse(std::string_view token, double& value) {
  if (!token.empty() && token.front() == '+') token.remove_prefix(1);
  const auto [end, bad] = std::from_chars(token.data(), token.data() + token.size(), value);
  return bad == std::errc() && end == token.data() + token.size();
}

class Sampler {
 public:
  Sampler(const Database& db, const Options& o, std::uint64_t memory)
      : db_(db),
        patches_(extract(db, {.error = o.surface.error}).patches),
        blend_(make_evaluator(db, patches_, o.surface, memory)) {}

  // The first line may be a header: then columns named x and y (or the first two) are taken.
  void read(std::istream& in) {
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
      std::string_view rest = line;
      double values[2];
      int column = 0, found = 0;
      bool empty = true;
      for (std::string_view t = next_token(rest); !t.empty() && found < 2; t = next_token(rest), ++column) {
        empty = false;
        const int want = column == columns_[0] ? 0 : column == columns_[1] ? 1 : -1;
        if (want < 0) continue;
        if (!parse(t, values[want])) break;
        ++found;
      }
      if (empty || line[0] == '#') continue;
      if (found < 2) {
        if (number == 1 && header(line)) continue;
        throw Error("line " + std::to_string(number), "it does not start with two numbers x y");
      }
      x_.push_back(values[0]), y_.push_back(values[1]);
      if (x_.size() == kBatch) flush();
    }
    flush();
  }

  /// How many points there were, and how many patches were read for one.
  std::string summary() const {
    const double mean = counts_.points ? double(counts_.contributions) / double(counts_.points) : 0;
    return fmt::format("{} point{} from {} patches on {}; {:.3f} patches read a point, {} at most",
                       counts_.points, counts_.points == 1 ? "" : "s", patches_.size(), engine_name(*blend_),
                       mean, counts_.most);
  }

 private:
  bool header(std::string_view line) {
    int column = 0;
    for (std::string_view t = next_token(line); !t.empty(); t = next_token(line), ++column) {
      double number;
      if (parse(t, number)) return false;
      if (t == "x" || t == "X" || t == "\"x\"") columns_[0] = column;
      if (t == "y" || t == "Y" || t == "\"y\"") columns_[1] = column;
    }
    return column >= 2;
  }

  void flush() {
    height_.resize(x_.size()), bound_.resize(x_.size()), source_.resize(x_.size());
    const BlendCounts c =
        blend_->at_points(x_, y_, {.height = height_, .bound = bound_, .source = source_, .patch = {}});
    counts_.points += c.points, counts_.contributions += c.contributions,
        counts_.most = std::max(counts_.most, c.most);
    fmt::memory_buffer out;
    for (std::size_t k = 0; k < x_.size(); ++k) {
      if (source_[k] == 0) {
        fmt::format_to(std::back_inserter(out), "{} {} nan nan -\n", x_[k], y_[k]);
        continue;
      }
      const std::string& name = db_.grids()[size_t(std::abs(source_[k])) - 1].info.name;
      fmt::format_to(std::back_inserter(out), "{} {} {} {} {}{}\n", x_[k], y_[k], height_[k], bound_[k], name,
                     source_[k] < 0 ? "(filled)" : "");
    }
    if (std::fwrite(out.data(), 1, out.size(), stdout) != out.size() || std::fflush(stdout) != 0)
      throw Error("standard output", "it cannot be written", "is the disk full?");
    x_.clear(), y_.clear();
  }

  const Database& db_;
  std::vector<PatchId> patches_;
  std::unique_ptr<Evaluator> blend_;
  int columns_[2] = {0, 1};
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
