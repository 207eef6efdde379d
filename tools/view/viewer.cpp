#include "tools/view/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <optional>

#include "db/stopwatch.h"
#include "query/extract.h"
#include "render/tile_cut.h"
#include "tools/cli.h"
#include "tools/output_file.h"
#include "tools/scene_setup.h"

namespace patchwork::cli {

namespace {

constexpr double kIdleWait = 0.05;     // seconds between looks at the database while nothing moves
constexpr double kFetchWait = 0.004;   // while tiles are being fetched
constexpr double kPanelPeriod = 0.25;  // seconds that figures stay readable
constexpr double kLongestStep = 1;     // seconds: a hitch does not throw the camera away
constexpr double kFirstStep = 1.0 / 60;
constexpr double kClearance = 2;  // metres between the eye that flies and the ground, known to half of it
constexpr double kFinest = 0.25, kCoarsest = 64;  // pixels of error

const Rows kKeys{{"W  S", "forward, back"},
                 {"A  D", "left, right"},
                 {"E  Q", "up, down"},
                 {"Shift", "five times as fast"},
                 {"Mouse drag, arrows", "turn"},
                 {"Wheel", "speed"},
                 {"Ctrl + wheel", "zoom"},
                 {},
                 {"Space", "play the scene's path, or rest"},
                 {"+  -", "finer, coarser"},
                 {"O", "figures"},
                 {"M", "map of tiles"},
                 {"G", "edges of triangles"},
                 {"P", "print the camera as a scene"},
                 {"F1", "this list"},
                 {"Esc", "end"}};

std::string name_of(const Database& db) { return std::filesystem::path(db.path()).filename().string(); }

RendererOptions realtime(const Scene& scene, const Window& window, std::uint64_t memory) {
  RendererOptions r = renderer_options(scene, memory);
  r.width = std::max(window.width(), 1), r.height = std::max(window.height(), 1);
  r.realtime = true;
  return r;
}

// At first, what is looked at is reached in five seconds.
FlyCamera first(const Database& db, const Scene& scene) {
  const Camera c = cameras(db, scene).front();
  return {c, 0.2 * glm::distance(vec(c.eye), vec(c.look))};
}

std::vector<Corners> outlines(const Database& db) {
  std::vector<Corners> all;
  for (const Grid& g : db.grids()) all.push_back(g.info.frame.corners(g.info.shape.footprint()));
  return all;
}

// Metres; nothing where there is no data.
std::optional<double> ground_below(const Database& db, const Point3& eye, const Scene& scene) {
  const double x[] = {eye.x}, y[] = {eye.y};
  const Extent here{eye.x, eye.y, eye.x, eye.y};
  const Extraction found = extract(db, TileCut(0.5 * kClearance, {here}));
  double height = NAN;
  Blend(db, found.patches, {.smoothness = scene.smoothness}).at_points(x, y, {{&height, 1}, {}, {}, {}});
  return std::isnan(height) ? std::nullopt : std::optional(height);
}

Json json_of(const Point3& p) { return {p.x, p.y, p.z}; }

}  // namespace

Viewer::Viewer(Database& db, const Scene& scene, const std::string& scene_text, const ViewOptions& options)
    : db_(db),
      scene_(scene),
      scene_text_(scene_text),
      options_(options),
      window_({.title = "Patchwork: " + name_of(db),
               .width = scene.width,
               .height = scene.height,
               .validation = options.validation}),
      renderer_(window_.device(), db, realtime(scene, window_, options.memory)),
      fly_(first(db, scene)),
      path_(scene.path ? std::optional<CameraPath>(*scene.path) : std::nullopt),
      playing_(path_.has_value()),
      pixel_error_(scene.pixel_error),
      width_(window_.width()),
      height_(window_.height()),
      last_step_(Clock::now()) {}

// A member of the scene's file stays as it was, but for what was flown and typed.
void Viewer::print_scene() const {
  Json scene = Json::parse(scene_text_);
  const Camera c = camera();
  scene.erase("path");
  scene["camera"] = {{"eye", json_of(c.eye)}, {"look", json_of(c.look)}, {"fov_degrees", c.fov_degrees}};
  scene["size"] = {c.width, c.height};
  scene["pixel_error"] = pixel_error_;
  if (scene_.effects.wireframe && !scene["effects"].contains("wireframe"))
    scene["effects"]["wireframe"] = Json::object();
  if (!scene_.effects.wireframe && scene.contains("effects")) scene["effects"].erase("wireframe");
  print(scene);
  std::fflush(stdout);
}

void Viewer::toggle_wireframe() {
  auto& wireframe = scene_.effects.wireframe;
  if (wireframe)
    wireframe.reset();
  else
    wireframe.emplace();
  renderer_.change(scene_.effects);
}

bool Viewer::obey(const WindowInput& input) {
  for (const Command c : input.commands) {
    restless_ = true, last_panels_ = {};
    switch (c) {
      case Command::end:
        return false;
      case Command::help:
        help_ = !help_;
        break;
      case Command::overlay:
        overlay_ = !overlay_;
        break;
      case Command::map:
        map_ = !map_;
        break;
      case Command::wireframe:
        toggle_wireframe();
        break;
      case Command::print:
        print_scene();
        break;
      case Command::play:
        playing_ = path_ && !playing_;
        if (playing_ && flown_ >= path_->length()) flown_ = 0;
        break;
      case Command::finer:
        pixel_error_ = std::max(pixel_error_ / std::sqrt(2.0), kFinest);
        break;
      case Command::coarser:
        pixel_error_ = std::min(pixel_error_ * std::sqrt(2.0), kCoarsest);
        break;
    }
  }
  return true;
}

// While nothing moved the clock ran, but nobody steered.
void Viewer::steer(const WindowInput& input) {
  const auto now = Clock::now();
  const double passed = std::chrono::duration<double>(now - last_step_).count();
  last_step_ = now;
  playing_ = playing_ && input.idle();
  if (playing_) return play(std::min(passed, moves_ ? kLongestStep : kFirstStep));
  fly_.drag(input.drag_x, input.drag_y, std::max(window_.height(), 1));
  fly_.change_speed(input.speed), fly_.zoom(input.zoom);
  fly_.step(input.steering, std::min(passed, moves_ ? kLongestStep : kFirstStep));
  moves_ = fly_.moves() || !input.idle();
  if (fly_.moves())
    if (const auto ground = ground_below(db_, fly_.eye(), scene_)) fly_.keep_above(*ground + kClearance);
}

// Who steers takes over from where the path led.
void Viewer::play(double seconds) {
  flown_ = std::min(flown_ + scene_.path->speed * seconds, path_->length());
  fly_ = {path_->at(flown_, window_.width(), window_.height()), fly_.speed()};
  moves_ = playing_ = flown_ < path_->length();
}

bool Viewer::lay_panels() {
  const auto now = Clock::now();
  if (!restless_ || std::chrono::duration<double>(now - last_panels_).count() < kPanelPeriod) return false;
  restless_ = false, last_panels_ = now;
  panels_.clear();
  if (overlay_) {
    Rows rows = meter_.rows();
    rows.insert(rows.end(), {{},
                             {"Speed", length_text(playing_ ? scene_.path->speed : fly_.speed()) + "/s"},
                             {"Eye", fmt::format("{:.0f} m", fly_.eye().z)},
                             {"Database", fmt::format("version {}", db_.version())},
                             {"", "F1: keys"}});
    panels_.push_back({table_panel(name_of(db_), rows, 220), 10, 10});
  }
  int beside = 0;  // the map
  if (map_) {
    const std::vector<TileKey> tiles = renderer_.tiles();
    panels_.push_back(
        {map_panel(renderer_.lattice(), {db_.extent(), tiles, outlines(db_), camera()}), -11, 10});
    beside = panels_.back().image.width + 10;
  }
  if (help_) panels_.push_back({table_panel("Keys", kKeys, 300), -11 - beside, 10});
  Image legend = legend_panel(renderer_, width_, height_);
  if (legend.width > 0) panels_.push_back({std::move(legend), -11, -11});
  return true;
}

double Viewer::frame(const WindowInput& input) {
  const bool reshaped = window_.width() != width_ || window_.height() != height_;
  width_ = window_.width(), height_ = window_.height();
  renderer_.reshape(width_, height_, pixel_error_);
  const bool changed = renderer_.refresh(db_);
  const FrameStats stats = renderer_.draw(camera());
  restless_ |= changed || reshaped || stats.redrawn || stats.tiles_made > 0;
  const bool other_panels = lay_panels();
  const Stopwatch watch;
  const bool shows = stats.redrawn || other_panels || reshaped || input.damaged || options_.frames > 0;
  if (shows) window_.show(renderer_, panels_);
  meter_.add(stats, watch.milliseconds());
  if (stats.redrawn || moves_ || options_.frames > 0) return 0;
  return stats.tiles_wanted > 0 ? kFetchWait : kIdleWait;
}

// A window that rests waits for events and looks at the database now and then.
void Viewer::run() {
  double wait = 0;
  int frames = 0;
  while (options_.frames == 0 || frames < options_.frames) {
    const WindowInput input = window_.look(wait);
    if (!obey(input)) break;
    steer(input);
    wait = kIdleWait;
    if (window_.width() == 0) continue;
    wait = frame(input);
    ++frames;
  }
  if (!options_.screenshot.empty() && frames > 0)
    write_picture(options_.screenshot, window_.shown(renderer_, panels_));
}

}  // namespace patchwork::cli
