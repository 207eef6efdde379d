// The knobs of a picture: pixel error, the way of tessellating and the directions of sky light, each frame
// made from nothing.
#include "tools/cost/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/camera_path.h"
#include "render/renderer.h"
#include "render/scene.h"
#include "tools/cost/check_points.h"
#include "tools/scene_setup.h"

namespace patchwork::cli {

namespace {

constexpr double kFrameErrors[] = {0.5, 1, 2, 4, 16};  // pixels
constexpr double kTessellated = 2;                     // pixels: where the ways of tessellating are compared
// Vertices are placed in float32 and pixels hit between them (tests/render/renderer_test.cpp).
constexpr double kRoundingPart = 1.001, kRoundingPixels = 0.01;

constexpr int kDirections[] = {4, 8, 16};

struct FrameKnob {
  std::string knob, value;
  double pixel_error;
  Tessellation tessellation = Tessellation::hardware;  // these are first frames, whose tiles are all made
  int directions = 0;                                  // of sky light; 0: none

  bool same_work(const FrameKnob& o) const {
    return pixel_error == o.pixel_error && tessellation == o.tessellation && directions == o.directions;
  }
};

std::vector<FrameKnob> all_knobs() {
  std::vector<FrameKnob> all;
  for (const double pixels : kFrameErrors) all.push_back({"frame", fmt::format("{:g}", pixels), pixels});
  for (const auto& [name, way] : kTessellations) all.push_back({"tessellation", name, kTessellated, way});
  all.push_back({"sky_directions", "no sky light", kTessellated});
  for (const int n : kDirections)
    all.push_back({"sky_directions", std::to_string(n), kTessellated, Tessellation::hardware, n});
  return all;
}

class Frames {
 public:
  Frames(const Database& db, std::shared_ptr<Device> device, const FrameScene& scene)
      : db_(db),
        device_(std::move(device)),
        scene_(scene),
        best_(db, extract(db, {.error = 0}).patches, {.smoothness = scene.smoothness}) {}

  // What a frame shows and keeps to.
  CostRow facts(const FrameKnob& k) const {
    CostRow row{.knob = k.knob, .value = k.value, .unit = "px", .asked = k.pixel_error};
    row.samples = double(scene_.camera.width) * scene_.camera.height, row.file_bytes = db_.file_bytes();
    Renderer renderer = renderer_of(k);
    const FrameStats s = renderer.draw(scene_.camera);
    judge(renderer, s, row);
    return row;
  }
  void once(const FrameKnob& k, Stages& ms) const { add(renderer_of(k).draw(scene_.camera), ms); }

 private:
  Renderer renderer_of(const FrameKnob& k) const {
    SceneEffects effects;
    if (k.directions > 0) effects.sky = effects::Sky{.directions = k.directions};
    return Renderer(device_, db_,
                    {.width = scene_.camera.width,
                     .height = scene_.camera.height,
                     .pixel_error = k.pixel_error,
                     .smoothness = scene_.smoothness,
                     .memory = scene_.memory,
                     .tessellation = k.tessellation,
                     .effects = effects});
  }

  static void add(const FrameStats& s, Stages& ms) {
    ms.query.push_back(s.select_ms + s.extract_ms), ms.fetch.push_back(s.send_ms);
    ms.blend.push_back(s.blend_ms), ms.tessellate.push_back(s.finish_ms + s.factors_ms);
    ms.draw.push_back(s.draw_ms);
    // What these leave of the frame: heights for the light map are taken on the host, its texels made on the
    // card.
    const double others =
        s.select_ms + s.extract_ms + s.send_ms + s.blend_ms + s.finish_ms + s.factors_ms + s.draw_ms;
    ms.light.push_back(std::max(0., s.total_ms - others));
  }

  void judge(const Renderer& renderer, const FrameStats& s, CostRow& row) const {
    std::vector<double> off = screen_distances(best_, scene_.camera, renderer.depth());
    row.patches = s.patches_sent, row.bytes = s.bytes_up;
    if (renderer.tessellation() != Tessellation::published) {
      row.bound = row.bound_p99 = s.pixels_reached;
      for (const double d : off) row.beyond += d > s.pixels_reached * kRoundingPart + kRoundingPixels;
    }
    row.error = figures_of(off);
  }

  const Database& db_;
  std::shared_ptr<Device> device_;
  FrameScene scene_;
  Blend best_;
};

Measurable measurable(const std::shared_ptr<const Frames>& frames, const FrameKnob& k) {
  return {frames->facts(k),
          std::make_shared<const MeasuredRun>([frames, k](Stages& ms) { frames->once(k, ms); })};
}

}  // namespace

FrameScene frame_scene(const Database& db, const Extent& e, const std::string& file, std::uint64_t memory) {
  const Scene scene = file.empty() ? Scene{} : read_scene(file);
  FrameScene f{.camera = {{}, {}, 60, scene.width, scene.height},
               .smoothness = scene.smoothness,
               .memory = std::min<std::size_t>(memory / 2, std::size_t{1} << 30)};
  if (scene.camera) f.camera = scene.view();
  if (scene.path) f.camera = CameraPath(*scene.path).frame(0, scene.width, scene.height);
  if (scene.camera || scene.path) return f;
  const double w = e.xmax - e.xmin, h = e.ymax - e.ymin;
  f.camera.eye = {e.xmin + 0.1 * w, e.ymin + 0.1 * h, 0};
  f.camera.look = {e.xmin + 0.6 * w, e.ymin + 0.6 * h, db.heights().highest};
  f.camera.eye.z = f.camera.look.z + 0.05 * std::min(w, h);
  return f;
}

std::vector<Measurable> frame_settings(const Database& db, std::shared_ptr<Device> device,
                                       const FrameScene& scene) {
  const auto frames = std::make_shared<const Frames>(db, std::move(device), scene);
  const std::vector<FrameKnob> knobs = all_knobs();
  std::vector<Measurable> all;
  for (const FrameKnob& k : knobs) {
    const auto same = std::find_if(knobs.begin(), knobs.end(), [&](const auto& o) { return o.same_work(k); });
    const auto place = std::size_t(same - knobs.begin());
    all.push_back(place < all.size() ? all[place] : measurable(frames, k));
    all.back().row.knob = k.knob, all.back().row.value = k.value;
  }
  return all;
}

Measurable frame_setting(const Database& db, std::shared_ptr<Device> device, const FrameScene& scene,
                         const std::string& knob, double pixel_error) {
  return measurable(std::make_shared<const Frames>(db, std::move(device), scene),
                    {knob, fmt::format("frame, {:g} px", pixel_error), pixel_error});
}

}  // namespace patchwork::cli
