#include "tools/scene_setup.h"

#include <algorithm>

#include "render/camera_path.h"

namespace patchwork::cli {

RendererOptions renderer_options(const Scene& scene, std::uint64_t memory) {
  RendererOptions r{.width = scene.width, .height = scene.height};
  r.pixel_error = scene.pixel_error, r.smoothness = scene.smoothness, r.composition = scene.blend;
  if (scene.far) r.far = *scene.far;
  r.memory = std::min<std::size_t>(memory / 2, std::size_t{1} << 30);
  r.background = scene.background, r.effects = scene.effects, r.legend = scene.legend;
  return r;
}

std::vector<Camera> cameras(const Database& db, const Scene& scene) {
  if (scene.camera) return {scene.view()};
  if (scene.path) {
    const CameraPath path(*scene.path);
    std::vector<Camera> all;
    for (int k = 0; k < path.frames(); ++k) all.push_back(path.frame(k, scene.width, scene.height));
    return all;
  }
  const HeightRange heights = db.heights();
  return {overview(db.extent(), heights.lowest, heights.highest, 45, scene.width, scene.height)};
}

}  // namespace patchwork::cli
