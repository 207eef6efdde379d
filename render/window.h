// A window on the screen that shows what a renderer drew, with opaque panels over it.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "blend/vulkan/device.h"
#include "render/fly_camera.h"
#include "render/picture.h"
#include "render/renderer.h"

namespace patchwork {

enum class Command { end, help, overlay, map, wireframe, print, finer, coarser, play };

/// What a person did since the last look.
struct WindowInput {
  Steering steering;              ///< what is held down, or was for a moment
  double drag_x = 0, drag_y = 0;  ///< pixels, right and down, with a mouse button held
  double speed = 0, zoom = 0;     ///< notches of the wheel; with Ctrl it zooms
  std::vector<Command> commands;  ///< in their order
  bool damaged = false;           ///< what is shown must be shown anew
  bool idle() const {
    return steering == Steering{} && drag_x == 0 && drag_y == 0 && speed == 0 && zoom == 0;
  }
};

/// An opaque picture laid over the window, its top left corner at (x, y), which may be negative: then it is
/// counted from the right or the lower edge of the window. What does not fit is cut off.
struct Panel {
  Image image;
  int x = 0, y = 0;
};

struct WindowOptions {
  std::string title;
  int width = 1280, height = 720;  ///< pixels
  bool validation = false;         ///< see DeviceOptions
};

/// There is one at a time. Used by the thread that made it, which on some systems must be the first.
class Window {
 public:
  /// Throws Error: no display, no device that draws on it.
  explicit Window(const WindowOptions& options);
  ~Window();

  const std::shared_ptr<Device>& device() const;
  /// Pixels of the picture that it shows; 0 x 0 while it is hidden.
  int width() const;
  int height() const;

  /// Waits until something happens or `seconds` have passed.
  WindowInput look(double seconds);
  /// The renderer's last picture and the panels. Waits for the screen where that keeps a pace. Throws Error:
  /// the device was lost.
  void show(const Renderer& renderer, std::span<const Panel> panels);
  /// What show() puts on the screen, as a picture.
  Image shown(const Renderer& renderer, std::span<const Panel> panels);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
