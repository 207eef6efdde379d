// What verbs that make pictures take from a scene.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "render/scene.h"

namespace patchwork::cli {

/// By the names that people use.
inline const std::map<std::string, Tessellation> kTessellations{{"hardware", Tessellation::hardware},
                                                                {"mesh", Tessellation::mesh},
                                                                {"published", Tessellation::published}};

/// `memory`: bytes that the process may take; the card gets half of it, and 1 GiB at most.
RendererOptions renderer_options(const Scene& scene, std::uint64_t memory);

/// The scene's camera, its path's frames, or one camera that sees all of the terrain.
std::vector<Camera> cameras(const Database& db, const Scene& scene);

}  // namespace patchwork::cli
