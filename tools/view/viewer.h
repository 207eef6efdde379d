// The window to fly in: what a person does becomes a camera, frames follow, figures lie over them.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "db/database.h"
#include "render/camera_path.h"
#include "render/scene.h"
#include "render/window.h"
#include "tools/view/frame_meter.h"

namespace patchwork::cli {

struct ViewOptions {
  int frames = 0;                       ///< ends after so many; 0: when it is told to
  std::string screenshot;               ///< a PNG of what the window shows when it ends; empty: none
  std::size_t memory = kDefaultMemory;  ///< bytes that the process may take
  bool validation = false;              ///< see DeviceOptions
};

class Viewer {
 public:
  /// `scene` is what `scene_text` (JSON) says; what is printed keeps its other members. REQUIRES:
  /// `db` outlives it. Throws Error: no display, no device.
  Viewer(Database& db, const Scene& scene, const std::string& scene_text, const ViewOptions& options);
  /// Returns when the person ends it. Throws Error: the device was lost, damaged payloads.
  void run();
  /// Its validation layer's messages are whole when the viewer is gone.
  std::shared_ptr<Device> device() const { return window_.device(); }

 private:
  using Clock = std::chrono::steady_clock;

  bool obey(const WindowInput& input);  // false: it is told to end
  void steer(const WindowInput& input);
  void play(double seconds);
  double frame(const WindowInput& input);  // seconds until the next one is due
  bool lay_panels();                       // true: they look different
  void print_scene() const;
  void toggle_wireframe();
  Camera camera() const { return fly_.camera(window_.width(), window_.height()); }

  Database& db_;
  Scene scene_;
  std::string scene_text_;
  ViewOptions options_;
  Window window_;
  Renderer renderer_;
  FlyCamera fly_;
  std::optional<CameraPath> path_;  // the scene's
  double flown_ = 0;                // metres along it
  bool playing_;
  FrameMeter meter_;
  std::vector<Panel> panels_;
  bool overlay_ = true, help_ = false, map_ = false;
  bool moves_ = false, restless_ = true;  // restless: panels are out of date
  double pixel_error_;
  int width_ = 0, height_ = 0;  // of the renderer's picture
  Clock::time_point last_step_, last_panels_;
};

}  // namespace patchwork::cli
