#include "render/scene.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/grids.h"

namespace patchwork {
namespace {

using Json = nlohmann::ordered_json;

Scene parse(const std::string& text) { return parse_scene(text, "scene.json"); }
std::string refused(const std::string& text) {
  return refusal_of([&] { parse(text); });
}
bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Scene, AnEffectThatIsNotNamedDoesNotExist) {
  const Scene s = parse(R"({"camera": {"eye": [1, 2, 300], "look": [4, 5, 6]}})");
  EXPECT_EQ(s.camera->eye.z, 300);
  EXPECT_EQ(s.view().look.y, 5);
  EXPECT_EQ(s.width, 1280);
  EXPECT_EQ(s.smoothness, 1);
  const SceneEffects& e = s.effects;
  EXPECT_FALSE(e.sun || e.shadow || e.sky || e.water || e.haze || e.curvature || e.solar_disc || e.tints ||
               e.contours || e.error || e.source || e.cost || e.wireframe);
}

TEST(Scene, ReadsEveryKindOfMember) {
  const Scene s = parse(R"({
    "path": {"points": [[0, 0, 9], [100, 0, 9]], "targets": [[5, 5, 5]], "speed_m_s": 40, "frames": 12},
    "size": [640, 360], "pixel_error": 2, "smoothness": 2, "blend": "weighted", "far": 9000,
    "background": "#0a0B0c", "legend": false,
    "effects": {"sun": {"azimuth": 200, "color": "#ff0000"}, "shadow": {}, "water": {"level": -3.5},
                "tints": {"ramp": "cividis", "highest": 900}, "contours": {"interval": 25, "index": 4}}})");
  EXPECT_EQ(s.path->points.size(), 2u);
  EXPECT_EQ(s.path->targets.size(), 1u);
  EXPECT_EQ(s.path->speed, 40);
  EXPECT_EQ(s.path->frames, 12);
  EXPECT_EQ(s.width, 640);
  EXPECT_EQ(s.blend, Composition::weighted);
  EXPECT_EQ(s.background, (Color{10, 11, 12}));
  EXPECT_FALSE(s.legend);
  EXPECT_EQ(s.effects.sun->azimuth, 200);
  EXPECT_EQ(s.effects.sun->color, (Color{255, 0, 0}));
  EXPECT_EQ(s.effects.water->level, -3.5);
  EXPECT_EQ(s.effects.tints->ramp, RampName::cividis);
  EXPECT_FALSE(s.effects.tints->lowest);
  EXPECT_EQ(*s.effects.tints->highest, 900);
}

TEST(Scene, ARefusalNamesThePlaceAndWhatIsThere) {
  const auto says = [](const std::string& text, const std::string& message) {
    EXPECT_EQ(refused(text), "scene.json: " + message);
  };
  says(R"({"effects": {"sun": {"elevation": "high"}}})",
       "effects.sun.elevation: it must be a number from -90 to 90, found \"high\"");
  says(R"({"effects": {"sun": {"elevation": 91}}})",
       "effects.sun.elevation: it must be a number from -90 to 90, found 91");
  says(R"({"effects": {"sky": {"directions": 8.5}}})",
       "effects.sky.directions: it must be a whole number from 4 to 32, found 8.5");
  says(R"({"effects": {"contours": {}}})",
       "effects.contours.interval: it is missing; between two lines, metres");
  says(R"({"effects": {"haze": {"visibility": 0}}})",
       "effects.haze.visibility: it must be a number above 0, found 0");
  says(R"({"path": {"points": [[0, 0, 0], [1, 2]]}})",
       "path.points[1]: it must be three numbers [x, y, z], found [1,2]");
  says(R"({"path": {"points": [[0, 0, 0], [1, 2, null]]}})",
       "path.points[1][2]: it must be a number, found null");
  says(R"({"path": {"points": [[0, 0, 0]]}})",
       "path.points: it must be a list of at least 2 points [x, y, z], found [[0,0,0]]");
  says(R"({"size": [640]})", "size: it must be two whole numbers [width, height]");
  says(R"({"size": [640, 0]})", "size[1]: it must be a whole number from 1 to 16384, found 0");
  says(R"({"blend": "both"})", "blend: it must be \"priority\" or \"weighted\", found \"both\"");
  says(R"({"background": "#12345g"})", "background: it must be a colour like \"#7dab8c\", found \"#12345g\"");
  says(R"({"effects": []})", "effects: it must be an object {...}, found []");
  says("[]", "it must be an object {...}, found []");
  const std::string deep = std::string(300000, '[') + std::string(300000, ']');
  says("{\"camera\": " + deep + "}", "camera: it must be an object {...}, found a deep array");
}

TEST(Scene, AnUnknownMemberIsNamedWithTheKnownOnes) {
  const std::string text = refused(R"({"effects": {"haze": {"density": 1}}})");
  EXPECT_TRUE(contains(text, "effects.haze.density: nothing of this name is known here")) << text;
  EXPECT_TRUE(contains(text, "known: visibility, base, scale_height, color")) << text;
  EXPECT_TRUE(contains(refused(R"({"effects": {"fog": {}}})"), "effects.fog: nothing of this name"));
}

TEST(Scene, MembersThatNeedOrExcludeEachOther) {
  const std::string camera = R"("camera": {"eye": [0, 0, 1], "look": [0, 1, 0]})";
  EXPECT_TRUE(contains(refused("{" + camera + R"(, "path": {"points": [[0, 0, 0], [1, 0, 0]]}})"),
                       "path: a scene has a camera or a path"));
  EXPECT_TRUE(contains(refused(R"({"camera": {"eye": [1, 2, 3], "look": [1, 2, 3]}})"), "camera.look:"));
  EXPECT_TRUE(contains(refused(R"({"path": {"points": [[0, 0, 0], [0, 0, 5]]}})"), "path.points[1]:"));
  EXPECT_TRUE(contains(refused(R"({"effects": {"shadow": {}}})"), "effects.shadow: it needs the sun"));
  EXPECT_TRUE(contains(refused(R"({"effects": {"solar_disc": {}}})"), "effects.solar_disc: it needs"));
  EXPECT_TRUE(contains(refused(R"({"effects": {"error": {}, "cost": {}}})"), "effects: only one of"));
  EXPECT_TRUE(contains(refused(R"({"effects": {"tints": {"lowest": 5, "highest": 5}}})"),
                       "effects.tints.highest: it must be above lowest"));
  EXPECT_EQ(refused("{" + camera + "}"), "");
}

TEST(Scene, TextThatIsNoJsonIsRefusedWithItsLine) {
  EXPECT_TRUE(contains(refused("{\n  \"size\": [1, }"), "it is no JSON: parse error at line 2"));
  EXPECT_TRUE(contains(refused("{\"far\": 1e999}"), "it is no JSON"));
  EXPECT_TRUE(contains(refused(""), "it is no JSON"));
  EXPECT_TRUE(contains(refusal_of([] { read_scene("/nowhere/scene.json"); }), "it cannot be read"));
}

// ---- the published schema

// Visits every described member as (path of names, its schema).
void each_member(const Json& object, std::vector<std::string> path,
                 const std::function<void(const std::vector<std::string>&, const Json&)>& visit) {
  for (const auto& [name, schema] : object.at("properties").items()) {
    path.push_back(name);
    visit(path, schema);
    if (schema.value("type", "") == "object") each_member(schema, path, visit);
    path.pop_back();
  }
}

// A document with `value` at `path`, and what the members on the way need.
std::string document(const std::vector<std::string>& path, const Json& value) {
  const Json needed{{"camera", {{"eye", {0, 0, 1}}, {"look", {0, 1, 0}}}},
                    {"path", {{"points", {{0, 0, 0}, {1, 0, 0}}}}},
                    {"water", {{"level", 0}}},
                    {"contours", {{"interval", 10}}}};
  Json root = Json::object();
  Json* at = &root;
  for (const std::string& name : path) {
    if (name != path.back() && needed.contains(name)) (*at)[name] = needed[name];
    at = &(*at)[name];
  }
  *at = value;
  if (root.contains("effects") && root["effects"].is_object() && path.back() != "sun")
    root["effects"].emplace("sun", Json::object());
  return root.dump();
}

TEST(SceneSchema, IsTheOnePublished) {
  if (std::getenv("PATCHWORK_WRITE_SCHEMA")) std::ofstream(PATCHWORK_SCENE_SCHEMA) << scene_schema();
  std::ifstream file(PATCHWORK_SCENE_SCHEMA);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_TRUE(text.str() == scene_schema())
      << "run this test with PATCHWORK_WRITE_SCHEMA=1 to publish it anew";
}

TEST(SceneSchema, TheParserTakesDefaultsAndLimitsAndNothingBeyond) {
  int defaults = 0, limits = 0, types = 0;
  each_member(Json::parse(scene_schema()), {}, [&](const std::vector<std::string>& path, const Json& s) {
    const auto taken = [&](const Json& v) { return refused(document(path, v)); };
    std::string place;
    for (const std::string& name : path) place += (place.empty() ? "" : ".") + name;
    if (s.contains("default")) {
      EXPECT_EQ(taken(s["default"]), "") << place;
      ++defaults;
    }
    for (const char* least : {"minimum", "exclusiveMinimum"})
      if (s.contains(least) && s["type"] != "array") {
        const double v = s[least].get<double>();
        EXPECT_TRUE(contains(taken(Json(v - 1)), place + ": ")) << place;
        const Json smallest = s["type"] == "integer" ? Json(int(v)) : Json(v);
        EXPECT_EQ(taken(smallest).empty(), std::string(least) == "minimum") << place;
        ++limits;
      }
    if (s.contains("maximum") && s["type"] != "array") {
      EXPECT_TRUE(contains(taken(Json(s["maximum"].get<double>() + 1)), place + ": ")) << place;
      ++limits;
    }
    for (const Json& name : s.value("enum", Json::array())) EXPECT_EQ(taken(name), "") << place;
    // Nothing is of this type.
    EXPECT_TRUE(contains(taken(nullptr), place + ": ")) << place << ' ' << taken(nullptr);
    ++types;
  });
  EXPECT_GT(defaults, 40);
  EXPECT_GT(limits, 40);
  EXPECT_GT(types, 60);
}

}  // namespace
}  // namespace patchwork
