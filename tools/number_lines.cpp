#include "tools/number_lines.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <numeric>

#include "db/error.h"
#include "tools/cli.h"

namespace patchwork::cli {

namespace {

constexpr std::size_t kNowhere = std::string_view::npos;

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

// The fields of a line, one after the other.
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

bool parse(std::string_view token, double& value) {
  if (!token.empty() && token.front() == '+') token.remove_prefix(1);
  const auto [end, bad] = std::from_chars(token.data(), token.data() + token.size(), value);
  return bad == std::errc() && end == token.data() + token.size();
}

// As many numbers as there are values and nothing else, between blanks or one of what parts fields each:
// "x,y,h x,y,h".
bool parse_all(std::string_view line, std::span<double> values) {
  std::size_t found = 0;
  bool parted = false;  // since the last number
  for (std::size_t at = 0; at < line.size();) {
    if (rank_of(line[at]) > 0) {
      if (parted || found == 0) return false;  // an empty field
      parted = true;
    }
    if (rank_of(line[at]) > 0 || is_blank(line[at])) {
      ++at;
      continue;
    }
    const std::size_t to = std::min(line.find_first_of(" \r\t;,", at), line.size());
    if (found == values.size() || !parse(line.substr(at, to - at), values[found++])) return false;
    at = to, parted = false;
  }
  return found == values.size() && !parted;
}

// Adds to what is listed between commas.
void list(std::string& all, std::string_view one) {
  if (!all.empty()) all.append(", ");
  all.append(one);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
}

}  // namespace

NumberLines::NumberLines(std::istream& in, std::vector<Names> columns)
    : in_(in), names_(std::move(columns)), places_(names_.size()) {
  std::iota(places_.begin(), places_.end(), std::size_t{0});
}

bool NumberLines::next(std::span<double> values) {
  while (std::getline(in_, line_)) {
    if (++number_ == 1 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);  // a mark of UTF-8
    Fields fields(line_);
    if (!fields.more() || line_[0] == '#') continue;
    std::size_t found = 0;
    for (std::size_t column = 0; fields.more() && found < places_.size(); ++column) {
      const std::string_view field = fields.next();
      const auto place = std::find(places_.begin(), places_.end(), column);
      if (place == places_.end()) continue;
      if (!parse(field, values[std::size_t(place - places_.begin())])) break;
      ++found;
    }
    const bool first = !begun_;
    begun_ = true;
    if (found == places_.size() || (!named_ && parse_all(line_, values))) return true;
    if (first && is_header(line_)) continue;
    std::string columns, names;
    for (std::size_t k = 0; k < places_.size(); ++k)
      list(columns, std::to_string(places_[k] + 1)), list(names, names_[k].front());
    throw Error("line " + std::to_string(number_),
                "its columns " + columns + " are not the numbers " + names);
  }
  expect_end_of(in_);
  return false;
}

// A line without a number: of names of all columns, or, of none, just as many words.
bool NumberLines::is_header(std::string_view line) {
  std::vector<std::size_t> at(names_.size(), kNowhere);
  std::size_t column = 0;
  bool words = true;  // none should have been a number
  for (Fields fields(line); fields.more(); ++column) {
    const std::string name = lower_case(fields.next());
    double number;
    if (parse(name, number)) return false;
    words =
        words && (name.empty() || std::string_view("0123456789+-.").find(name[0]) == std::string_view::npos);
    for (std::size_t k = 0; k < names_.size(); ++k)
      if (at[k] == kNowhere && std::find(names_[k].begin(), names_[k].end(), name) != names_[k].end()) {
        at[k] = column;
        break;
      }
  }
  if (column < names_.size()) return false;
  const auto missing = std::find(at.begin(), at.end(), kNowhere);
  if (missing == at.end()) {
    places_ = at, named_ = true;
  } else if (column > names_.size() ||
             std::any_of(at.begin(), at.end(), [](auto c) { return c != kNowhere; })) {
    std::string names;
    for (const std::string_view name : names_[std::size_t(missing - at.begin())]) list(names, name);
    throw Error("header", "it names no column " + names.substr(0, names.find(',')),
                "it may be called: " + names);
  }
  return named_ || words;
}

}  // namespace patchwork::cli
