#include <algorithm>
#include <cassert>
#include <cstring>

#include "render/vulkan/graphics_impl.h"
#include "render/vulkan/shaders.h"
#include "render/vulkan/terrain_pass_impl.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr VkDescriptorType kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
// terrain.glsl, needs.comp, edges.comp, triangles.comp
constexpr VkDescriptorType kMeshTypes[] = {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
                                           kTexels,   // draws
                                           kTexels,   // heights
                                           kTexels,   // blocks
                                           kStorage,  // needs
                                           kTexels,
                                           kStorage,  // edges
                                           kTexels,
                                           kStorage,  // counts
                                           kTexels,
                                           kStorage,   // indices
                                           kStorage};  // calls
constexpr std::uint32_t kPush = 8;                     // triangles.comp
// terrain.glsl, terrain.frag; effects.glsl
constexpr auto kTypes = [] {
  std::array<VkDescriptorType, FrameEffects::kFirst + FrameEffects::kTypes.size()> t{
      VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kTexels, kTexels, kTexels,
      VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER};
  for (std::size_t k = 0; k < FrameEffects::kTypes.size(); ++k)
    t[FrameEffects::kFirst + k] = FrameEffects::kTypes[k];
  return t;
}();
constexpr VkBufferUsageFlags kWordTexels =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT;
constexpr std::size_t kBlockTexel = TileStore::kBlocks * 16;  // bytes of a tile: one texel a block

OwnedPipeline terrain_pipeline(const Bindings& bindings, VkRenderPass pass, const FrameEffects& effects,
                               bool holes, bool edges) {
  const std::vector<std::uint32_t> constants = effects.constants(holes, edges);
  return make_graphics(bindings, pass,
                       {.stages = {{VK_SHADER_STAGE_VERTEX_BIT, shaders::terrain_vert()},
                                   {VK_SHADER_STAGE_FRAGMENT_BIT, shaders::terrain_frag()}},
                        .constants = constants,
                        .lines = edges});
}

OwnedPipeline sky_pipeline(const Bindings& bindings, VkRenderPass pass, const FrameEffects& effects) {
  const std::vector<std::uint32_t> constants = effects.constants(false, false);
  return make_graphics(bindings, pass,
                       {.stages = {{VK_SHADER_STAGE_VERTEX_BIT, shaders::sky_vert()},
                                   {VK_SHADER_STAGE_FRAGMENT_BIT, shaders::sky_frag()}},
                        .constants = constants,
                        .depth_write = false,
                        .compare = VK_COMPARE_OP_EQUAL});
}

}  // namespace

TerrainPass::TerrainPass(const Device::Impl& device, const TileStore& store, VkRenderPass pass,
                         std::uint32_t most_tiles)
    : store_(store),
      pass_(pass),
      mesh_bindings_(device, kMeshTypes, kPush),
      bindings_(device, kTypes, 0, kStages),
      needs_pipeline_(make_pipeline(mesh_bindings_, shaders::needs(), {})),
      edges_pipeline_(make_pipeline(mesh_bindings_, shaders::edges(), {})),
      triangles_pipeline_(make_pipeline(mesh_bindings_, shaders::triangles(), {})),
      mesh_sets_(mesh_bindings_.make_set(mesh_set_)),
      sets_(bindings_.make_set(set_)),
      frame_(device, sizeof(FrameBlock), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, Where::upload),
      draws_(device, most_tiles * sizeof(TileDraw), VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, Where::upload),
      needs_(device, most_tiles * kBlockTexel, kWordTexels, Where::card),
      edges_(device, most_tiles * kBlockTexel, kWordTexels, Where::card),
      counts_(device, most_tiles * 4, kWordTexels, Where::card),
      calls_(device, 2 * sizeof(VkDrawIndexedIndirectCommand),
             VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, Where::upload),
      draw_texels_(texels(device, draws_, VK_FORMAT_R32G32B32A32_UINT)),
      need_texels_(texels(device, needs_, VK_FORMAT_R32G32B32A32_UINT)),
      edge_texels_(texels(device, edges_, VK_FORMAT_R32G32B32A32_UINT)),
      count_texels_(texels(device, counts_, VK_FORMAT_R32_UINT)) {
  bind_all(store);
}

void TerrainPass::bind_all(const TileStore& store) {
  const auto bind = [&](std::uint32_t at, const auto& what) { mesh_bindings_.bind(mesh_set_, at, what); };
  bind(0, frame_), bind(1, draw_texels_), bind(2, store.height_texels), bind(3, store.block_texels);
  bind(4, needs_), bind(5, need_texels_), bind(6, edges_), bind(7, edge_texels_);
  bind(8, counts_), bind(9, count_texels_), bind(11, calls_);
  bindings_.bind(set_, 0, frame_), bindings_.bind(set_, 1, draw_texels_);
  bindings_.bind(set_, 2, store.height_texels), bindings_.bind(set_, 3, need_texels_);
  bindings_.bind(set_, 4, store.sampler.get(), store.slopes.view(), VK_IMAGE_LAYOUT_GENERAL);
}

// Room for the most triangles that so many draws may have.
void TerrainPass::reserve(std::size_t draws) {
  const std::size_t bytes = draws * TileStore::kMostTriangles * 12;
  if (bytes <= indices_.bytes()) return;
  indices_ = Buffer(mesh_bindings_.device(), bytes + bytes / 4,
                    VK_BUFFER_USAGE_INDEX_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT |
                        VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                    Where::card);
  mesh_bindings_.bind(mesh_set_, 10, indices_);
}

// REQUIRES: those with holes come last.
void TerrainPass::set(const FrameBlock& frame, std::span<const TileDraw> draws) {
  assert(draws.size_bytes() <= draws_.bytes());
  std::memcpy(frame_.mapped(), &frame, sizeof frame);
  if (!draws.empty()) std::memcpy(draws_.mapped(), draws.data(), draws.size_bytes());
  const auto first_holed =
      std::find_if(draws.begin(), draws.end(), [](const TileDraw& d) { return d.holes; });
  solid_ = std::uint32_t(first_holed - draws.begin()), holed_ = std::uint32_t(draws.end() - first_holed);
  reserve(draws.size());
  // The numbers of indices come from triangles.comp.
  auto* calls = reinterpret_cast<VkDrawIndexedIndirectCommand*>(calls_.mapped());
  calls[0] = {0, 1, 0, 0, 0}, calls[1] = {0, 1, 3 * solid_ * TileStore::kMostTriangles, 0, 0};
  bytes_set_ = sizeof frame + draws.size_bytes() + 2 * sizeof *calls;
}

void TerrainPass::record_meshes(VkCommandBuffer commands) const {
  if (tiles() == 0) return;
  const std::uint32_t push[] = {solid_, TileStore::kMostTriangles};
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, mesh_bindings_.layout(), 0, 1, &mesh_set_,
                          0, nullptr);
  vkCmdPushConstants(commands, mesh_bindings_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, push);
  for (const OwnedPipeline* p : {&needs_pipeline_, &edges_pipeline_, &triangles_pipeline_}) {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, p->get());
    vkCmdDispatch(commands, tiles(), 1, 1);
    barrier(commands);
  }
}

std::vector<std::uint32_t> TerrainPass::read_mesh(Commands& commands) const {
  std::vector<std::uint32_t> names;
  if (tiles() == 0) return names;
  const Buffer to(mesh_bindings_.device(), indices_.bytes(), VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                  Where::readback);
  const VkCommandBuffer c = commands.begin();
  const VkBufferCopy all{0, 0, indices_.bytes()};
  vkCmdCopyBuffer(c, indices_.get(), to.get(), 1, &all);
  barrier(c);
  commands.submit(), commands.wait();
  const auto* from = reinterpret_cast<const std::uint32_t*>(to.mapped());
  const auto* calls = reinterpret_cast<const VkDrawIndexedIndirectCommand*>(calls_.mapped());
  for (int k = 0; k < 2; ++k)
    names.insert(names.end(), from + calls[k].firstIndex, from + calls[k].firstIndex + calls[k].indexCount);
  return names;
}

TerrainPass::Pipelines TerrainPass::make_pipelines(const FrameEffects& effects) const {
  Pipelines p;
  const bool edges = has(effects.on(), effects::Id::wireframe);
  for (const bool holes : {false, true}) {
    p.ground[holes] = terrain_pipeline(bindings_, pass_, effects, holes, false);
    if (edges) p.edges[holes] = terrain_pipeline(bindings_, pass_, effects, holes, true);
  }
  if (effects.draws_sky()) p.sky = sky_pipeline(bindings_, pass_, effects);
  return p;
}

void TerrainPass::use(const FrameEffects& effects) {
  if (generation_ != effects.generation()) effects.bind(bindings_, set_, store_);
  generation_ = effects.generation();
  const auto [at, fresh] = pipelines_.try_emplace(effects.on().to_ulong());
  if (fresh) at->second = make_pipelines(effects);
  used_ = &at->second;
}

void TerrainPass::record_draws(VkCommandBuffer commands) const {
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, bindings_.layout(), 0, 1, &set_, 0,
                          nullptr);
  if (tiles() > 0) vkCmdBindIndexBuffer(commands, indices_.get(), 0, VK_INDEX_TYPE_UINT32);
  const auto draw = [&](const std::array<OwnedPipeline, 2>& pipelines) {
    for (std::uint32_t holes = 0; holes < 2; ++holes) {
      if ((holes ? holed_ : solid_) == 0) continue;
      vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipelines[holes].get());
      vkCmdDrawIndexedIndirect(commands, calls_.get(), holes * sizeof(VkDrawIndexedIndirectCommand), 1, 0);
    }
  };
  draw(used_->ground);
  if (used_->edges[0]) draw(used_->edges);
  if (!used_->sky) return;
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, used_->sky.get());
  vkCmdDraw(commands, 3, 1, 0, 0);
}

}  // namespace patchwork::vk
