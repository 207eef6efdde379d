// Values of a JSON document: each is read at its place, refused by it, and has a schema. For implementations
// only: it brings nlohmann's header.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "db/point3.h"
#include "render/picture.h"

namespace patchwork {

using Json = nlohmann::ordered_json;

/// Where a value stands in a document: file "scene.json", place "path.points[2]".
struct JsonPlace {
  std::string file, place;
  JsonPlace member(const std::string& name) const {
    return {file, place.empty() ? name : place + "." + name};
  }
  JsonPlace element(std::size_t k) const { return {file, place + "[" + std::to_string(k) + "]"}; }
  /// Throws Error(file, "PLACE: problem", advice).
  [[noreturn]] void refuse(const std::string& problem, const std::string& advice = {}) const;
};

struct Range {
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  bool above = false;  ///< `least` itself is too small
};
inline Range between(double least, double most) { return {.least = least, .most = most}; }
inline Range at_least(double least) { return {.least = least}; }
inline Range above(double least) { return {.least = least, .above = true}; }

// Values: each throws Error at its place.
double read_number(const Json& j, const JsonPlace& at, const Range& range);
int read_integer(const Json& j, const JsonPlace& at, const Range& range);
bool read_flag(const Json& j, const JsonPlace& at);
std::size_t read_choice(const Json& j, const JsonPlace& at, const std::vector<std::string>& names);
Color read_color(const Json& j, const JsonPlace& at);
Point3 read_point(const Json& j, const JsonPlace& at);
std::vector<Point3> read_points(const Json& j, const JsonPlace& at, std::size_t least);
void require_object(const Json& j, const JsonPlace& at);

// Their schemas.
Json number_schema(const Range& range);
Json integer_schema(const Range& range);
Json color_schema();
Json point_schema();
Json json_of(const Color& c);

}  // namespace patchwork
