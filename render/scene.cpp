#include "render/scene.h"

#include <fstream>
#include <sstream>

#include "db/error.h"
#include "render/fields.h"

namespace patchwork {

// Found by the arguments' namespace, so not in an unnamed one.
static constexpr int kLargestSide = 16384;  // pixels

static void describe(Fields<Viewpoint>& f) {
  f.point("eye", &Viewpoint::eye, "from where it is seen, metres [x, y, z]").required();
  f.point("look", &Viewpoint::look, "the point in the middle of the picture, metres [x, y, z]").required();
  f.number("fov_degrees", &Viewpoint::fov_degrees, between(0.01, 170), "the vertical angle of view");
}

static void describe(Fields<Flight>& f) {
  f.points("points", &Flight::points, 2, "that the eye passes, metres").required();
  f.points("targets", &Flight::targets, 1, "looked at on the way: one, or one for each point");
  f.number("look_ahead", &Flight::look_ahead, above(0), "metres of way ahead that are looked at");
  f.number("pitch", &Flight::pitch, between(-89, 89), "degrees above the way ahead; without targets");
  f.number("speed_m_s", &Flight::speed, above(0), "over ground, metres a second");
  f.number("frames_per_second", &Flight::frames_per_second, above(0), "pictures a second of the flight");
  f.integer("frames", &Flight::frames, between(1, Flight::kMostFrames),
            "so many pictures, whatever the speed");
  f.number("fov_degrees", &Flight::fov_degrees, between(0.01, 170), "the vertical angle of view");
}

static void describe(Fields<SceneEffects>& f) {
  using E = SceneEffects;
  f.object("sun", &E::sun, fields<effects::Sun>(), "sun light on the ground");
  f.object("shadow", &E::shadow, fields<effects::Shadow>(), "what the terrain shades; needs sun");
  f.object("sky", &E::sky, fields<effects::Sky>(), "light of the sky, by how much of it a place sees");
  f.object("water", &E::water, fields<effects::Water>(), "water up to a level");
  f.object("haze", &E::haze, fields<effects::Haze>(), "far things take the colour of the air");
  f.object("curvature", &E::curvature, fields<effects::Curvature>(), "of the earth, with refraction");
  f.object("solar_disc", &E::solar_disc, fields<effects::SolarDisc>(), "the sun itself; needs sun");
  f.object("tints", &E::tints, fields<effects::Tints>(), "colours by height");
  f.object("contours", &E::contours, fields<effects::Contours>(), "lines of equal height");
  f.object("error", &E::error, fields<effects::ErrorOverlay>(), "overlay: the bound of each height");
  f.object("source", &E::source, fields<effects::SourceOverlay>(), "overlay: which grid answers");
  f.object("cost", &E::cost, fields<effects::CostOverlay>(), "overlay: patches that a tile was made of");
  f.object("wireframe", &E::wireframe, fields<effects::Wireframe>(), "edges of the triangles drawn");
}

static void read_size(Scene& s, const Json& j, const JsonPlace& at) {
  if (!j.is_array() || j.size() != 2) at.refuse("it must be two whole numbers [width, height]");
  s.width = read_integer(j[0], at.element(0), between(1, kLargestSide));
  s.height = read_integer(j[1], at.element(1), between(1, kLargestSide));
}

static Json size_schema() {
  return {{"type", "array"},
          {"items", integer_schema(between(1, kLargestSide))},
          {"minItems", 2},
          {"maxItems", 2}};
}

static void describe(Fields<Scene>& f) {
  f.object("camera", &Scene::camera, fields<Viewpoint>(), "a single picture; without path");
  f.object("path", &Scene::path, fields<Flight>(), "a flight; without camera");
  f.add("size", size_schema(), "of a picture, pixels", Json{1280, 720}, read_size);
  f.number("pixel_error", &Scene::pixel_error, between(0, 1000), "largest error on the screen, pixels");
  f.integer("smoothness", &Scene::smoothness, between(0, 2), "continuous derivatives of the surface");
  f.choice("blend", &Scene::blend, {"priority", "weighted"}, "how patches are composed");
  f.number("far", &Scene::far, above(0), "metres along the line of sight; without: all of the terrain");
  f.color("background", &Scene::background, "of the sky");
  f.flag("legend", &Scene::legend, "drawn where an effect has a scale");
  f.object("effects", &Scene::effects, fields<SceneEffects>(),
           "what the picture calls for, each by its name");
}

namespace {

bool same(const Point3& a, const Point3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

void check_flight(const Flight& p, const JsonPlace& at) {
  for (std::size_t k = 1; k < p.points.size(); ++k)
    if (p.points[k].x == p.points[k - 1].x && p.points[k].y == p.points[k - 1].y)
      at.member("points").element(k).refuse("it lies above or below the point before it");
  if (p.targets.size() > 1 && p.targets.size() != p.points.size())
    at.member("targets").refuse("it must be one point, or as many as points");
}

// What no single member can tell.
void check(const Scene& s, const JsonPlace& at) {
  if (s.camera && s.path) at.member("path").refuse("a scene has a camera or a path, not both");
  if (s.camera && same(s.camera->eye, s.camera->look))
    at.member("camera").member("look").refuse("it is the same point as eye");
  if (s.path) check_flight(*s.path, at.member("path"));
  const SceneEffects& e = s.effects;
  const JsonPlace effects = at.member("effects");
  if (e.shadow && !e.sun) effects.member("shadow").refuse("it needs the sun", "add \"sun\": {}");
  if (e.solar_disc && !e.sun) effects.member("solar_disc").refuse("it needs the sun", "add \"sun\": {}");
  if (e.error.has_value() + e.source.has_value() + e.cost.has_value() > 1)
    effects.refuse("only one of error, source and cost can lie over the ground");
  const auto ordered = [&](const char* name, const auto& scale) {
    if (scale && scale->lowest && scale->highest && !(*scale->lowest < *scale->highest))
      effects.member(name).member("highest").refuse("it must be above lowest");
  };
  ordered("tints", e.tints), ordered("error", e.error);
}

// nlohmann's message without its own prefix: "[json.exception.parse_error.101] parse error at line 2, ...".
std::string reason(const std::exception& e) {
  const std::string text = e.what();
  const std::size_t end = text.find("] ");
  return end == std::string::npos ? text : text.substr(end + 2);
}

}  // namespace

std::string default_scene_text() { return R"({"effects": {"sun": {}, "tints": {}}})"; }
Scene default_scene() { return parse_scene(default_scene_text(), "the default scene"); }

Scene parse_scene(const std::string& json, const std::string& where) {
  const JsonPlace at{where, ""};
  Json j;
  try {
    j = Json::parse(json);
  } catch (const Json::exception& e) {
    at.refuse("it is no JSON: " + reason(e));
  }
  Scene scene = fields<Scene>().read(j, at);
  check(scene, at);
  return scene;
}

std::string scene_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw Error(path, "it cannot be read");
  return text.str();
}

Scene read_scene(const std::string& path) { return parse_scene(scene_text(path), path); }

std::string scene_schema() {
  Json s{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "A scene of patchwork"}};
  const Json members = fields<Scene>().schema();
  s.update(members);
  return s.dump(2) + "\n";
}

}  // namespace patchwork
