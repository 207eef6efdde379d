// The members of a JSON object, each described once: how it is read, what is wrong with it and where, and
// what the published schema says of it. For implementations only: it brings nlohmann's header.
//
//     void describe(Fields<Sun>& f) { f.number("azimuth", &Sun::azimuth, between(0, 360), "degrees ..."); }
//     Sun sun = fields<Sun>().read(json, {"scene.json", "effects.sun"});
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "render/json_values.h"

namespace patchwork {

template <class T>
class Fields {
 public:
  using Read = std::function<void(T&, const Json&, const JsonPlace&)>;

  /// M: double or std::optional<double>. Members that the document lacks keep T's own default.
  template <class M>
  Fields& number(const char* name, M T::*m, const Range& r, const char* about) {
    return add(name, number_schema(r), about, default_of(m),
               [m, r](T& t, const Json& j, const JsonPlace& at) { t.*m = read_number(j, at, r); });
  }
  template <class M>
  Fields& integer(const char* name, M T::*m, const Range& r, const char* about) {
    return add(name, integer_schema(r), about, default_of(m),
               [m, r](T& t, const Json& j, const JsonPlace& at) { t.*m = read_integer(j, at, r); });
  }
  Fields& flag(const char* name, bool T::*m, const char* about) {
    return add(name, {{"type", "boolean"}}, about, Json(T{}.*m),
               [m](T& t, const Json& j, const JsonPlace& at) { t.*m = read_flag(j, at); });
  }
  /// `names` in the order of the enumeration.
  template <class E>
  Fields& choice(const char* name, E T::*m, const std::vector<std::string>& names, const char* about) {
    return add(name, {{"enum", names}}, about, Json(names[std::size_t(T{}.*m)]),
               [m, names](T& t, const Json& j, const JsonPlace& at) { t.*m = E(read_choice(j, at, names)); });
  }
  Fields& color(const char* name, Color T::*m, const char* about) {
    return add(name, color_schema(), about, json_of(T{}.*m),
               [m](T& t, const Json& j, const JsonPlace& at) { t.*m = read_color(j, at); });
  }
  Fields& point(const char* name, Point3 T::*m, const char* about) {
    return add(name, point_schema(), about, {},
               [m](T& t, const Json& j, const JsonPlace& at) { t.*m = read_point(j, at); });
  }
  Fields& points(const char* name, std::vector<Point3> T::*m, std::size_t least, const char* about) {
    return add(name, {{"type", "array"}, {"items", point_schema()}, {"minItems", least}}, about, {},
               [m, least](T& t, const Json& j, const JsonPlace& at) { t.*m = read_points(j, at, least); });
  }
  template <class U>
  Fields& object(const char* name, std::optional<U> T::*m, const Fields<U>& f, const char* about) {
    return add(name, f.schema(), about, {},
               [m, f](T& t, const Json& j, const JsonPlace& at) { t.*m = f.read(j, at); });
  }
  template <class U>
  Fields& object(const char* name, U T::*m, const Fields<U>& f, const char* about) {
    return add(name, f.schema(), about, {},
               [m, f](T& t, const Json& j, const JsonPlace& at) { t.*m = f.read(j, at); });
  }
  /// The member added last must be there.
  Fields& required() {
    members_.back().required = true;
    return *this;
  }
  Fields& add(const char* name, Json schema, const char* about, const Json& standard, Read read) {
    schema["description"] = about;
    if (!standard.is_null()) schema["default"] = standard;
    members_.push_back({name, false, std::move(schema), std::move(read)});
    return *this;
  }

  /// Throws Error: no object, a member that is not described or not valid, one that is required and missing.
  T read(const Json& j, const JsonPlace& at) const {
    require_object(j, at);
    for (const auto& [name, value] : j.items()) refuse_unknown(name, at);
    T t{};
    for (const Member& m : members_) {
      if (j.contains(m.name))
        m.read(t, j[m.name], at.member(m.name));
      else if (m.required)
        at.member(m.name).refuse("it is missing", m.schema["description"].template get<std::string>());
    }
    return t;
  }

  Json schema() const {
    Json s{{"type", "object"}, {"additionalProperties", false}, {"properties", Json::object()}};
    for (const Member& m : members_) {
      s["properties"][m.name] = m.schema;
      if (m.required) s["required"].push_back(m.name);
    }
    return s;
  }

 private:
  struct Member {
    std::string name;
    bool required;
    Json schema;
    Read read;
  };
  std::vector<Member> members_;

  template <class M>
  static Json default_of(M T::*m) {
    const T t{};
    if constexpr (std::is_arithmetic_v<M>)
      return Json(t.*m);
    else
      return t.*m ? Json(*(t.*m)) : Json();
  }
  void refuse_unknown(const std::string& name, const JsonPlace& at) const {
    std::string known;
    for (const Member& m : members_) {
      if (m.name == name) return;
      known += (known.empty() ? "" : ", ") + m.name;
    }
    at.member(name).refuse("nothing of this name is known here", "known: " + known);
  }
};

/// What `void describe(Fields<T>&)` says of T, found beside it.
template <class T>
Fields<T> fields() {
  Fields<T> f;
  describe(f);
  return f;
}

}  // namespace patchwork
