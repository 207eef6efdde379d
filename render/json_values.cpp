#include "render/json_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "db/error.h"

namespace patchwork {

namespace {

constexpr std::size_t kShown = 40;  // characters of a wrong value

// Values within values, so many levels of them at most: a file may nest more than a stack holds.
bool is_shallow(const Json& j, int levels = 3) {
  if (!j.is_structured()) return true;
  return levels > 0 &&
         std::all_of(j.begin(), j.end(), [&](const Json& inner) { return is_shallow(inner, levels - 1); });
}

std::string found(const Json& j) {
  if (!is_shallow(j)) return std::string(", found a deep ") + j.type_name();
  const std::string text = j.dump(-1, ' ', true, Json::error_handler_t::replace);
  return ", found " + (text.size() > kShown ? text.substr(0, kShown) + "..." : text);
}

std::string text_of(const Range& r) {
  if (std::isfinite(r.least) && std::isfinite(r.most))
    return fmt::format(" from {:g} to {:g}", r.least, r.most);
  if (!std::isfinite(r.least)) return "";
  return r.above ? fmt::format(" above {:g}", r.least) : fmt::format(", {:g} or more", r.least);
}

bool holds(const Range& r, double v) { return (r.above ? v > r.least : v >= r.least) && v <= r.most; }

}  // namespace

void JsonPlace::refuse(const std::string& problem, const std::string& advice) const {
  throw Error(file, (place.empty() ? "" : place + ": ") + problem, advice);
}

double read_number(const Json& j, const JsonPlace& at, const Range& range) {
  if (!j.is_number() || !std::isfinite(j.get<double>()) || !holds(range, j.get<double>()))
    at.refuse("it must be a number" + text_of(range) + found(j));
  return j.get<double>();
}

int read_integer(const Json& j, const JsonPlace& at, const Range& range) {
  if (!j.is_number_integer() || !holds(range, j.get<double>()) || std::abs(j.get<double>()) > 1e9)
    at.refuse("it must be a whole number" + text_of(range) + found(j));
  return j.get<int>();
}

bool read_flag(const Json& j, const JsonPlace& at) {
  if (!j.is_boolean()) at.refuse("it must be true or false" + found(j));
  return j.get<bool>();
}

std::size_t read_choice(const Json& j, const JsonPlace& at, const std::vector<std::string>& names) {
  std::string all;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (j.is_string() && j.get<std::string>() == names[k]) return k;
    all += (k == 0 ? "" : k + 1 < names.size() ? ", " : " or ") + ('"' + names[k] + '"');
  }
  at.refuse("it must be " + all + found(j));
}

Color read_color(const Json& j, const JsonPlace& at) {
  const std::string text = j.is_string() ? j.get<std::string>() : "";
  std::uint32_t rgb = 0;
  if (text.size() == 7 && text[0] == '#') {
    const char* const end = text.data() + 7;
    if (std::from_chars(text.data() + 1, end, rgb, 16).ptr == end)
      return {std::uint8_t(rgb >> 16), std::uint8_t(rgb >> 8), std::uint8_t(rgb)};
  }
  at.refuse("it must be a colour like \"#7dab8c\"" + found(j));
}

Point3 read_point(const Json& j, const JsonPlace& at) {
  if (!j.is_array() || j.size() != 3) at.refuse("it must be three numbers [x, y, z]" + found(j));
  const auto number = [&](std::size_t k) { return read_number(j[k], at.element(k), {}); };
  return {number(0), number(1), number(2)};
}

std::vector<Point3> read_points(const Json& j, const JsonPlace& at, std::size_t least) {
  if (!j.is_array() || j.size() < least)
    at.refuse(fmt::format("it must be a list of at least {} points [x, y, z]", least) + found(j));
  std::vector<Point3> points;
  for (std::size_t k = 0; k < j.size(); ++k) points.push_back(read_point(j[k], at.element(k)));
  return points;
}

void require_object(const Json& j, const JsonPlace& at) {
  if (!j.is_object()) at.refuse("it must be an object {...}" + found(j));
}

Json number_schema(const Range& r) {
  Json s{{"type", "number"}};
  if (std::isfinite(r.least)) s[r.above ? "exclusiveMinimum" : "minimum"] = r.least;
  if (std::isfinite(r.most)) s["maximum"] = r.most;
  return s;
}

Json integer_schema(const Range& r) {
  Json s = number_schema(r);
  s["type"] = "integer";
  return s;
}

Json color_schema() { return {{"type", "string"}, {"pattern", "^#[0-9a-fA-F]{6}$"}}; }

Json point_schema() {
  return {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}};
}

Json json_of(const Color& c) { return fmt::format("#{:02x}{:02x}{:02x}", c.r, c.g, c.b); }

}  // namespace patchwork
