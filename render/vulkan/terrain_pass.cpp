#include <cassert>
#include <cstring>

#include "render/vulkan/graphics_impl.h"
#include "render/vulkan/shaders.h"
#include "render/vulkan/terrain_pass_impl.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
// terrain.glsl, factors.comp
constexpr VkDescriptorType kFactorTypes[] = {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kTexels, kTexels, kTexels,
                                             VK_DESCRIPTOR_TYPE_STORAGE_BUFFER};
// terrain.glsl, terrain.tesc, terrain.frag; effects.glsl
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
constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT |
                                       VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT |
                                       VK_SHADER_STAGE_FRAGMENT_BIT;

OwnedPipeline terrain_pipeline(const Bindings& bindings, VkRenderPass pass, const FrameEffects& effects,
                               bool holes, bool edges) {
  const std::vector<std::uint32_t> constants = effects.constants(holes, edges);
  return make_graphics(bindings, pass,
                       {.stages = {{VK_SHADER_STAGE_VERTEX_BIT, shaders::terrain_vert()},
                                   {VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT, shaders::terrain_tesc()},
                                   {VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT, shaders::terrain_tese()},
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
                        .topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST,
                        .depth_write = false,
                        .compare = VK_COMPARE_OP_EQUAL});
}

}  // namespace

TerrainPass::TerrainPass(const Device::Impl& device, const TileStore& store, VkRenderPass pass,
                         std::uint32_t most_tiles)
    : store_(store),
      pass_(pass),
      factor_bindings_(device, kFactorTypes, 0),
      bindings_(device, kTypes, 0, kStages),
      factors_pipeline_(make_pipeline(factor_bindings_, shaders::factors(), {})),
      edges_pipeline_(make_pipeline(factor_bindings_, shaders::edges(), {})),
      factor_sets_(factor_bindings_.make_set(factor_set_)),
      edge_sets_(factor_bindings_.make_set(edge_set_)),
      sets_(bindings_.make_set(set_)),
      frame_(device, sizeof(FrameBlock), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, Where::upload),
      draws_(device, most_tiles * sizeof(TileDraw), VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, Where::upload),
      factors_(device, most_tiles * TileStore::kBlocks * 4, kWordTexels, Where::card),
      edges_(device, most_tiles * TileStore::kBlocks * 4, kWordTexels, Where::card),
      calls_(device, most_tiles * sizeof(VkDrawIndirectCommand), VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT,
             Where::upload),
      draw_texels_(texels(device, draws_, VK_FORMAT_R32G32B32A32_UINT)),
      factor_texels_(texels(device, factors_, VK_FORMAT_R32_UINT)),
      edge_texels_(texels(device, edges_, VK_FORMAT_R32_UINT)) {
  bind_all(store);
  // Each draw is a tile of its own: 64 blocks, the instance says which tile. One that tessellates more than
  // 65 536 vertices is drawn wrongly by llvmpipe; these have at most 64 * 9 * 17.
  auto* calls = reinterpret_cast<VkDrawIndirectCommand*>(calls_.mapped());
  for (std::uint32_t d = 0; d < most_tiles; ++d) calls[d] = {TileStore::kBlocks, 1, 0, d};
}

void TerrainPass::bind_all(const TileStore& store) {
  for (const VkDescriptorSet set : {factor_set_, edge_set_}) {
    factor_bindings_.bind(set, 0, frame_), factor_bindings_.bind(set, 1, draw_texels_);
    factor_bindings_.bind(set, 2, store.height_texels);
  }
  factor_bindings_.bind(factor_set_, 3, store.block_texels), factor_bindings_.bind(factor_set_, 4, factors_);
  factor_bindings_.bind(edge_set_, 3, factor_texels_), factor_bindings_.bind(edge_set_, 4, edges_);
  bindings_.bind(set_, 0, frame_), bindings_.bind(set_, 1, draw_texels_);
  bindings_.bind(set_, 2, store.height_texels), bindings_.bind(set_, 3, edge_texels_);
  bindings_.bind(set_, 4, store.sampler.get(), store.slopes.view(), VK_IMAGE_LAYOUT_GENERAL);
}

// Draws keep their numbers, because they name each other: calls with and without holes are told apart.
void TerrainPass::set(const FrameBlock& frame, std::span<const TileDraw> draws) {
  assert(draws.size_bytes() <= draws_.bytes());
  std::memcpy(frame_.mapped(), &frame, sizeof frame);
  if (!draws.empty()) std::memcpy(draws_.mapped(), draws.data(), draws.size_bytes());
  solid_ = holed_ = 0;
  auto* calls = reinterpret_cast<VkDrawIndirectCommand*>(calls_.mapped());
  for (std::uint32_t d = 0; d < draws.size(); ++d)
    if (!draws[d].holes) calls[solid_++].firstInstance = d;
  for (std::uint32_t d = 0; d < draws.size(); ++d)
    if (draws[d].holes) calls[solid_ + holed_++].firstInstance = d;
  bytes_set_ = sizeof frame + draws.size_bytes() + draws.size() * sizeof(VkDrawIndirectCommand);
}

void TerrainPass::record_factors(VkCommandBuffer commands) const {
  if (this->draws() == 0) return;
  const auto run = [&](const OwnedPipeline& pipeline, VkDescriptorSet set) {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.get());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, factor_bindings_.layout(), 0, 1, &set,
                            0, nullptr);
    vkCmdDispatch(commands, this->draws(), 1, 1);
    barrier(commands);
  };
  run(factors_pipeline_, factor_set_);
  run(edges_pipeline_, edge_set_);
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
  const auto draw = [&](const OwnedPipeline& pipeline, std::uint32_t first, std::uint32_t n) {
    if (n == 0) return;
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.get());
    vkCmdDrawIndirect(commands, calls_.get(), first * sizeof(VkDrawIndirectCommand), n,
                      sizeof(VkDrawIndirectCommand));
  };
  draw(used_->ground[0], 0, solid_);
  draw(used_->ground[1], solid_, holed_);
  if (used_->edges[0]) draw(used_->edges[0], 0, solid_), draw(used_->edges[1], solid_, holed_);
  if (!used_->sky) return;
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, used_->sky.get());
  vkCmdDraw(commands, 3, 1, 0, 0);
}

}  // namespace patchwork::vk
