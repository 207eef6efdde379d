// Pictures of the renderer as settings.
#pragma once

#include <memory>

#include "blend/vulkan/device.h"
#include "render/camera.h"
#include "tools/cost/cost.h"

namespace patchwork::cli {

/// A picture of the renderer.
struct FrameScene {
  Camera camera;
  int smoothness = 1;
  std::size_t memory = 0;  ///< bytes on the card
};
/// The scene's camera, the first of its path, or, without either, one over the south-west corner of the
/// extent. Throws Error: the scene's file.
FrameScene frame_scene(const Database& db, const Extent& extent, const std::string& scene_file,
                       std::uint64_t memory);
/// Pixel errors, ways of tessellating and directions of sky light: errors in pixels, measured against the
/// best surface through each pixel's depth. Refers to `db`. Throws Error: a device that does not draw.
std::vector<Measurable> frame_settings(const Database& db, std::shared_ptr<Device> device,
                                       const FrameScene& scene);
/// One of them, at a pixel error.
Measurable frame_setting(const Database& db, std::shared_ptr<Device> device, const FrameScene& scene,
                         const std::string& knob, double pixel_error);

}  // namespace patchwork::cli
