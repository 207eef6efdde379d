#include "render/vulkan/shaders.h"

namespace patchwork::shaders {

namespace {

// Made by glslc in the build tree, numbers alone (render/CMakeLists.txt).
constexpr std::uint32_t kTileFinish[] = {
#include "tile_finish.comp.inc"
};
constexpr std::uint32_t kFactors[] = {
#include "factors.comp.inc"
};
constexpr std::uint32_t kEdges[] = {
#include "edges.comp.inc"
};
constexpr std::uint32_t kTerrainVert[] = {
#include "terrain.vert.inc"
};
constexpr std::uint32_t kTerrainTesc[] = {
#include "terrain.tesc.inc"
};
constexpr std::uint32_t kTerrainTese[] = {
#include "terrain.tese.inc"
};
constexpr std::uint32_t kTerrainFrag[] = {
#include "terrain.frag.inc"
};
constexpr std::uint32_t kSkyVert[] = {
#include "sky.vert.inc"
};
constexpr std::uint32_t kSkyFrag[] = {
#include "sky.frag.inc"
};
constexpr std::uint32_t kLight[] = {
#include "light.comp.inc"
};

}  // namespace

std::span<const std::uint32_t> tile_finish() { return kTileFinish; }
std::span<const std::uint32_t> factors() { return kFactors; }
std::span<const std::uint32_t> edges() { return kEdges; }
std::span<const std::uint32_t> terrain_vert() { return kTerrainVert; }
std::span<const std::uint32_t> terrain_tesc() { return kTerrainTesc; }
std::span<const std::uint32_t> terrain_tese() { return kTerrainTese; }
std::span<const std::uint32_t> terrain_frag() { return kTerrainFrag; }
std::span<const std::uint32_t> sky_vert() { return kSkyVert; }
std::span<const std::uint32_t> sky_frag() { return kSkyFrag; }
std::span<const std::uint32_t> light() { return kLight; }

}  // namespace patchwork::shaders
