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
constexpr std::uint32_t kMeshFinish[] = {
#include "mesh_finish.comp.inc"
};
constexpr std::uint32_t kFactorEdges[] = {
#include "factor_edges.comp.inc"
};
constexpr std::uint32_t kNeeds[] = {
#include "needs.comp.inc"
};
constexpr std::uint32_t kMeshEdges[] = {
#include "mesh_edges.comp.inc"
};
constexpr std::uint32_t kTriangles[] = {
#include "triangles.comp.inc"
};
constexpr std::uint32_t kMeshVert[] = {
#include "mesh.vert.inc"
};
constexpr std::uint32_t kBlockVert[] = {
#include "block.vert.inc"
};
constexpr std::uint32_t kBlockTesc[] = {
#include "block.tesc.inc"
};
constexpr std::uint32_t kBlockTese[] = {
#include "block.tese.inc"
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
std::span<const std::uint32_t> mesh_finish() { return kMeshFinish; }
std::span<const std::uint32_t> factor_edges() { return kFactorEdges; }
std::span<const std::uint32_t> needs() { return kNeeds; }
std::span<const std::uint32_t> mesh_edges() { return kMeshEdges; }
std::span<const std::uint32_t> triangles() { return kTriangles; }
std::span<const std::uint32_t> mesh_vert() { return kMeshVert; }
std::span<const std::uint32_t> block_vert() { return kBlockVert; }
std::span<const std::uint32_t> block_tesc() { return kBlockTesc; }
std::span<const std::uint32_t> block_tese() { return kBlockTese; }
std::span<const std::uint32_t> terrain_frag() { return kTerrainFrag; }
std::span<const std::uint32_t> sky_vert() { return kSkyVert; }
std::span<const std::uint32_t> sky_frag() { return kSkyFrag; }
std::span<const std::uint32_t> light() { return kLight; }

}  // namespace patchwork::shaders
