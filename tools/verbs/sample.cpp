// patchwork sample: points in, heights and their bounds out, any number, as a stream.
#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <iostream>
#include <string_view>

#include "db/error.h"
#include "tools/cli.h"

namespace patchwork::cli {

namespace {

constexpr std::size_t kBatch = 1 << 18;  // points evaluated together
constexpr std::size_t kPiece = 4096;     // lines written by one thread

struct Options {
  std::string database;
  SurfaceOptions surface;
};

bool is_blank(char c) { return c == ' ' || c == '\r'; }
// Of what parts fields, the one of the highest rank in a line; 0: parts nothing.
int rank_of(char c) { return c == '\t' ? 3 : c == ';' ? 2 : c == ',' ? 1 : 0; }

std::string_view without_leading_blanks(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  return text;
}
std::string_view trimmed(std::string_view text) {
  text = without_leading_blanks(text);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

// The fields of a line, one after the other: between tabs, else between semicolons, else between commas,
// where empty ones count; else between blanks. Quoted ones may hold what else parts them.
class Fields {
 public:
  explicit Fields(std::string_view line) : left_(trimmed(line)), more_(!left_.empty()) {
    int best = 0;
    bool begins = true;  // a field, and with it perhaps a quote
    for (std::size_t at = 0; at < left_.size(); ++at) {
      if (begins && left_[at] == '"') at = std::min(closing_quote(at), left_.size() - 1);
      const int rank = rank_of(left_[at]);
      if (rank > best) best = rank, separator_ = left_[at];
      begins = rank > 0 || (begins && is_blank(left_[at]));
    }
  }

  bool more() const { return more_; }
  std::string_view next() {
    std::size_t to = std::min(behind_quotes(), left_.size());
    while (to < left_.size() && !(separator_ ? left_[to] == separator_ : is_blank(left_[to]))) ++to;
    std::string_view field = trimmed(left_.substr(0, to));
    more_ = to < left_.size();
    left_.remove_prefix(more_ ? to + 1 : left_.size());
    left_ = without_leading_blanks(left_);
    if (field.size() > 1 && field.front() == '"' && field.back() == '"')
      field = field.substr(1, field.size() - 2);
    return field;
  }

 private:
  // Where a field begins that may end at a separator: behind what is quoted.
  std::size_t behind_quotes() const { return !left_.empty() && left_.front() == '"' ? closing_quote(0) : 0; }
  // Of what is quoted from `open` on; two quotes in it are one.
  std::size_t closing_quote(std::size_t open) const {
    std::size_t at = left_.find('"', open + 1);
    while (at != std::string_view::npos && at + 1 < left_.size() && left_[at + 1] == '"')
      at = left_.find('"', at + 2);
    return at;
  }

  std::string_view left_;
  bool more_;
  char separator_ = 0;  // 0: blanks
};

// 0 for a column of x, 1 for one of y, -1 for any other.
int axis_named(std::string_view name) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  if (lower == "x" || lower == "easting") return 0;
  return lower == "y" || lower == "northing" ? 1 : -1;
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
        patches_(extract(db, {.error = o.surface.error, .strict = o.surface.strict}).patches),
        blend_(make_evaluator(db, patches_, o.surface, memory)) {}

  // The first line may be a header, which says which columns are x and y.
  void read(std::istream& in) {
    std::string line;
    for (std::size_t number = 1; std::getline(in, line); ++number) {
      if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);  // a mark of UTF-8
      Fields fields(line);
      if (!fields.more() || line[0] == '#') continue;
      double values[2];
      int found = 0;
      for (int column = 0; fields.more() && found < 2; ++column) {
        const std::string_view field = fields.next();
        const int want = column == columns_[0] ? 0 : column == columns_[1] ? 1 : -1;
        if (want >= 0 && !parse(field, values[want])) break;
        found += want >= 0;
      }
      if (found < 2) {
        if (x_.empty() && counts_.points == 0 && header(line)) continue;
        throw Error(
            "line " + std::to_string(number),
            fmt::format("its columns {} and {} are not two numbers x y", columns_[0] + 1, columns_[1] + 1));
      }
      x_.push_back(values[0]), y_.push_back(values[1]);
      if (x_.size() == kBatch) flush();
    }
    expect_end_of(in);
    flush();
  }

  /// How many points there were, and how many patches were read for one.
  std::string summary() const {
    return fmt::format("{} point{} from {} patches on {}; {:.3f} patches read a point, {} at most",
                       counts_.points, counts_.points == 1 ? "" : "s", patches_.size(), engine_name(*blend_),
                       counts_.mean(), counts_.most);
  }

 private:
  // Columns named x and y, or easting and northing; where none is and there are but two, these.
  bool header(std::string_view line) {
    if (has_header_) return false;
    int at[2] = {-1, -1}, column = 0;
    for (Fields fields(line); fields.more(); ++column) {
      const std::string_view name = fields.next();
      double number;
      if (parse(name, number)) return false;
      const int axis = axis_named(name);
      if (axis >= 0 && at[axis] < 0) at[axis] = column;
    }
    if (column < 2) return false;
    if ((at[0] < 0) != (at[1] < 0) || (at[0] < 0 && column > 2))
      throw Error("header", fmt::format("it names no column {}", at[0] < 0 ? 'x' : 'y'),
                  "name the columns x and y, or easting and northing");
    if (at[0] >= 0) std::copy(at, at + 2, columns_);
    return has_header_ = true;
  }

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
    if (source_[k] == 0) {
      fmt::format_to(std::back_inserter(out), "{} {} nan nan -\n", x_[k], y_[k]);
      return;
    }
    const std::string& name = db_.grids()[size_t(std::abs(source_[k])) - 1].info.name;
    fmt::format_to(std::back_inserter(out), "{} {} {} {} {}{}\n", x_[k], y_[k], height_[k], bound_[k], name,
                   source_[k] < 0 ? "(filled)" : "");
  }

  const Database& db_;
  std::vector<PatchId> patches_;
  std::unique_ptr<Evaluator> blend_;
  int columns_[2] = {0, 1};
  bool has_header_ = false;
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
