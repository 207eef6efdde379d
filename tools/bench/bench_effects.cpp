// What each effect costs: a frame with it beside the same frame without, and what it stores.
#include <fmt/format.h>

#include <functional>

#include "render/renderer.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

constexpr int kWidth = 1280, kHeight = 720;

struct Case {
  const char* name;
  std::function<void(SceneEffects&)> add;
};

SceneEffects sun_alone() {
  SceneEffects e;
  e.sun = effects::Sun{.azimuth = 285, .elevation = 12};
  return e;
}

// Level with the highest ground, from a corner to the middle.
Camera camera_of(const Database& db) {
  const Extent e = db.extent();
  const double highest = db.heights().highest;
  const double x = e.xmax - e.xmin, y = e.ymax - e.ymin;
  return {{e.xmin + 0.2 * x, e.ymin + 0.2 * y, highest + 0.02 * x},
          {e.xmin + 0.5 * x, e.ymin + 0.5 * y, highest - 0.05 * x},
          60,
          kWidth,
          kHeight};
}

double water_level(const Database& db) {
  const HeightRange heights = db.heights();
  return heights.lowest + 0.3 * (heights.highest - heights.lowest);
}

std::vector<Case> cases(const Database& db) {
  using E = SceneEffects;
  const double level = water_level(db);
  return {{"sun", [](E&) {}},
          {"shadow", [](E& e) { e.shadow = effects::Shadow{}; }},
          {"sky", [](E& e) { e.sky = effects::Sky{}; }},
          {"water", [level](E& e) { e.water = effects::Water{.level = level}; }},
          {"haze", [](E& e) { e.haze = effects::Haze{}; }},
          {"curvature", [](E& e) { e.curvature = effects::Curvature{}; }},
          {"solar_disc", [](E& e) { e.solar_disc = effects::SolarDisc{}; }},
          {"tints", [](E& e) { e.tints = effects::Tints{}; }},
          {"contours", [](E& e) { e.contours = effects::Contours{}; }},
          {"error", [](E& e) { e.error = effects::ErrorOverlay{}; }},
          {"source", [](E& e) { e.source = effects::SourceOverlay{}; }},
          {"cost", [](E& e) { e.cost = effects::CostOverlay{}; }},
          {"wireframe", [](E& e) { e.wireframe = effects::Wireframe{}; }}};
}

// Frames of a camera that moves by centimetres: drawn anew, and no tile made.
class Side {
 public:
  Side(std::shared_ptr<Device> device, const Database& db, const SceneEffects& e)
      : renderer_(std::move(device), db, {.width = kWidth, .height = kHeight, .effects = e, .legend = false}),
        camera_(camera_of(db)) {
    first_ = renderer_.draw(camera_);
  }
  double draw_ms() {
    camera_.eye.x += 0.01;
    return renderer_.draw(camera_).draw_ms;
  }
  double stored_ms() const { return first_.light_ms; }

 private:
  Renderer renderer_;
  Camera camera_;
  FrameStats first_;
};

Work measure(const std::shared_ptr<Device>& device, const Database& db, const Case& c, int runs) {
  SceneEffects with = sun_alone();
  c.add(with);
  const bool is_sun = std::string(c.name) == "sun";
  Side ours(device, db, with), peer(device, db, is_sun ? SceneEffects{} : sun_alone());
  std::vector<double> a, b;
  for (int n = -1; n < runs; ++n) {
    const double x = ours.draw_ms(), y = peer.draw_ms();
    if (n >= 0) a.push_back(x), b.push_back(y);
  }
  const Spread mine = Spread::of(a), bare = Spread::of(b);
  return {fmt::format("frame with {}", c.name),
          "ms",
          true,
          mine,
          {{is_sun ? "no effect" : "sun alone", bare}},
          {{"adds_ms", mine.median - bare.median}, {"stored_once_ms", ours.stored_ms()}}};
}

// Shadow and sky are switched on: frames of a flight until their light is complete, the one frame that waits
// for it, and the flight's frames before.
Work light_coming(const std::shared_ptr<Device>& device, const Database& db) {
  SceneEffects lit = sun_alone();
  lit.shadow = effects::Shadow{}, lit.sky = effects::Sky{};
  Camera camera = camera_of(db);
  RendererOptions options{.width = kWidth, .height = kHeight, .effects = sun_alone(), .legend = false};
  Renderer waits(device, db, options);
  options.realtime = true;
  Renderer flies(device, db, options);
  const auto frame = [&](Renderer& r) {
    camera.eye.x += 0.01;
    return r.draw(camera);
  };
  while (frame(flies).tiles_wanted > 0) continue;
  std::vector<double> before, coming;
  for (int n = 0; n < 20; ++n) before.push_back(frame(flies).total_ms);
  flies.change(lit);
  for (bool complete = false; !complete;) {
    const FrameStats s = frame(flies);
    coming.push_back(s.total_ms), complete = s.light_left == 0;
  }
  frame(waits);
  waits.change(lit);
  const std::vector<double> at_once = {frame(waits).total_ms};
  Work w{"frames while shadow and sky come", "ms", true, Spread::of(coming), {}, {{"frames", coming.size()}}};
  w.peers.emplace_back("the frame that waits for them", Spread::of(at_once));
  w.peers.emplace_back("frames before", Spread::of(before));
  return w;
}

}  // namespace

std::vector<Work> bench_effects(const BenchOptions& o) {
  const WorkFolder folder(o);
  const std::string path = folder.path("effects.pwk");
  make_terrain(folder.path("terrain"),
               {"--size", fmt::format("{}", o.size), "--type", "Int16", "--scale", "0.1"});
  run_process({own_program("patchwork"), "import", path, folder.path("terrain/base.tif"), "--accuracy", "0.2",
               "--quiet"});
  const Database db = Database::open(path);
  const auto device = Device::open();
  std::vector<Work> all = {light_coming(device, db)};
  for (const Case& c : cases(db)) all.push_back(measure(device, db, c, o.runs));
  return all;
}

}  // namespace patchwork::cli
