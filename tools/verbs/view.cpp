// patchwork view: a window to fly in.
#include "db/error.h"
#include "tools/cli.h"
#include "tools/output_file.h"
#include "tools/view/viewer.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database, scene, screenshot;
  std::vector<int> size;
  double pixel_error = 0;
  int frames = 0;
  bool validation = false;
};

void run(const Options& o, const Common& common) {
  Database db = open_filled(o.database, common);
  refuse_overwriting(o.database, {o.screenshot});
  const std::string text = o.scene.empty() ? default_scene_text() : scene_text(o.scene);
  Scene scene = parse_scene(text, o.scene);
  if (!o.size.empty()) scene.width = o.size[0], scene.height = o.size[1];
  if (o.pixel_error > 0) scene.pixel_error = o.pixel_error;
  std::shared_ptr<Device> device;
  {
    Viewer viewer(db, scene, text,
                  {.frames = o.frames,
                   .screenshot = o.screenshot,
                   .memory = common.memory,
                   .validation = o.validation});
    device = viewer.device();
    viewer.run();
  }
  const std::vector<std::string> messages = device->messages();
  for (const std::string& m : messages) note(common, m);
  if (!messages.empty())
    throw Error("Vulkan", std::to_string(messages.size()) + " messages of its validation layer");
}

}  // namespace

void add_view(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "view", "a window to fly in; F1 lists its keys");
  v->add_option("DB", o->database, "the database; what others commit to it shows up")->required();
  v->add_option("--scene", o->scene, "JSON: camera or path, pixel error, effects (render/scene.schema.json)");
  v->add_option("--size", o->size, "width height, pixels; else the scene's")
      ->expected(2)
      ->check(CLI::Range(1, 16384));
  v->add_option("--pixel-error", o->pixel_error, "largest error on the screen, pixels; else the scene's")
      ->check(above_zero());
  v->add_option("--frames", o->frames, "ends after so many frames")->check(above_zero());
  v->add_option("--screenshot", o->screenshot, "a PNG of what the window shows when it ends");
  v->add_flag("--validation", o->validation, "Vulkan's validation layer watches; what it says is a failure")
      ->group("");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
