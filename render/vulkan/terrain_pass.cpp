#include <cassert>
#include <cstring>

#include "render/vulkan/graphics_impl.h"
#include "render/vulkan/shaders.h"
#include "render/vulkan/terrain_pass_impl.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
// terrain.glsl, block.tesc, terrain.frag; effects.glsl
constexpr auto kTypes = [] {
  std::array<VkDescriptorType, FrameEffects::kFirst + FrameEffects::kTypes.size()> t{
      VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kTexels, kTexels, kTexels,
      VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER};
  for (std::size_t k = 0; k < FrameEffects::kTypes.size(); ++k)
    t[FrameEffects::kFirst + k] = FrameEffects::kTypes[k];
  return t;
}();
constexpr VkShaderStageFlags kStages = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT |
                                       VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT |
                                       VK_SHADER_STAGE_FRAGMENT_BIT;

OwnedPipeline terrain_pipeline(const Bindings& bindings, VkRenderPass pass, const Subdivision& subdivision,
                               std::span<const std::uint32_t> constants, bool edges, bool front_only) {
  std::vector<GraphicsState::Stage> stages = subdivision.stages();
  stages.push_back({VK_SHADER_STAGE_FRAGMENT_BIT, shaders::terrain_frag()});
  return make_graphics(bindings, pass,
                       {.stages = std::move(stages),
                        .constants = constants,
                        .topology = subdivision.topology(),
                        .lines = edges,
                        .front_only = front_only});
}

OwnedPipeline sky_pipeline(const Bindings& bindings, VkRenderPass pass,
                           std::span<const std::uint32_t> constants) {
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
      bindings_(device, kTypes, 0, kStages),
      sets_(bindings_.make_set(set_)),
      frame_(device, sizeof(FrameBlock), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, Where::upload),
      draws_(device, most_tiles * sizeof(TileDraw), VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, Where::upload),
      draw_texels_(texels(device, draws_, VK_FORMAT_R32G32B32A32_UINT)) {
  const Subdivided what{device, store, frame_, draw_texels_, most_tiles};
  subdivision_ = store.holds.meshes ? make_mesh(what) : make_tessellation(what);
  bindings_.bind(set_, 0, frame_), bindings_.bind(set_, 1, draw_texels_);
  bindings_.bind(set_, 2, store.height_texels), bindings_.bind(set_, 3, subdivision_->facts());
  bindings_.bind(set_, 4, store.sampler.get(), store.slopes.view(), VK_IMAGE_LAYOUT_GENERAL);
}

void TerrainPass::set(const FrameBlock& frame, std::span<const TileDraw> draws) {
  assert(draws.size_bytes() <= draws_.bytes());
  std::memcpy(frame_.mapped(), &frame, sizeof frame);
  if (!draws.empty()) std::memcpy(draws_.mapped(), draws.data(), draws.size_bytes());
  groups_.clear();
  for (std::uint32_t d = 0; d < draws.size(); ++d) {
    const bool holes = draws[d].holes;
    const std::uint32_t effects = draws[d].effects;
    const bool same = !groups_.empty() && groups_.back().holes == holes && groups_.back().effects == effects;
    if (!same && groups_.size() < kMostGroups) groups_.push_back({d, 0, holes, effects});
    DrawGroup& last = groups_.back();
    ++last.count, last.holes |= holes, last.effects |= effects;
  }
  bytes_set_ = sizeof frame + draws.size_bytes() + subdivision_->set(groups_);
}

std::size_t TerrainPass::record_subdivision(VkCommandBuffer commands) const {
  if (groups_.empty()) return 0;
  subdivision_->record(commands);
  return subdivision_->dispatches();
}

TerrainPass::Pipelines& TerrainPass::pipelines(const FrameEffects& effects, const effects::Set& set) {
  return pipelines_[{effects.on().to_ulong(), set.to_ulong()}];
}

void TerrainPass::use(const FrameEffects& effects, bool front_only) {
  if (generation_ != effects.generation()) effects.bind(bindings_, set_, store_);
  generation_ = effects.generation();
  grounds_.clear(), edges_.clear();
  for (const DrawGroup& g : groups_) {
    const effects::Set set(g.effects);
    Pipelines& p = pipelines(effects, set);
    const auto make = [&](OwnedPipeline& pipeline, bool edges) {
      if (!pipeline)
        pipeline = terrain_pipeline(bindings_, pass_, *subdivision_, effects.constants(set, g.holes, edges),
                                    edges, front_only && !edges);
    };
    OwnedPipeline& ground = p.ground[g.holes][front_only];
    make(ground, false), grounds_.push_back(&ground);
    if (!has(effects.on(), effects::Id::wireframe)) continue;
    make(p.edges[g.holes], true), edges_.push_back(&p.edges[g.holes]);
  }
  sky_ = nullptr;
  if (!effects.draws_sky()) return;
  Pipelines& p = pipelines(effects, effects.on());
  if (!p.sky) p.sky = sky_pipeline(bindings_, pass_, effects.constants(effects.on(), false, false));
  sky_ = &p;
}

void TerrainPass::record_draws(VkCommandBuffer commands) const {
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, bindings_.layout(), 0, 1, &set_, 0,
                          nullptr);
  for (const auto* pipelines : {&grounds_, &edges_})
    for (std::size_t g = 0; g < pipelines->size(); ++g) {
      vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, (*pipelines)[g]->get());
      subdivision_->draw(commands, g);
    }
  if (!sky_) return;
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, sky_->sky.get());
  vkCmdDraw(commands, 3, 1, 0, 0);
}

}  // namespace patchwork::vk
