// Blocks as patches of the card's tessellation stages (Yusov and Shevtsov 2011, made conservative).
#include "render/vulkan/shaders.h"
#include "render/vulkan/subdivision_impl.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
// terrain.glsl, factors.comp
constexpr VkDescriptorType kTypes[] = {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kTexels, kTexels, kTexels,
                                       VK_DESCRIPTOR_TYPE_STORAGE_BUFFER};
constexpr VkBufferUsageFlags kWordTexels =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;

class Tessellation : public Subdivision {
 public:
  explicit Tessellation(const Subdivided& what)
      : bindings_(what.device, kTypes, 0),
        factors_pipeline_(make_pipeline(bindings_, shaders::factors(), {})),
        edges_pipeline_(make_pipeline(bindings_, shaders::factor_edges(), {})),
        factor_sets_(bindings_.make_set(factor_set_)),
        edge_sets_(bindings_.make_set(edge_set_)),
        factors_(what.device, what.most_tiles * TileStore::kBlocks * 4, kWordTexels, Where::card),
        edges_(what.device, what.most_tiles * TileStore::kBlocks * 4, kWordTexels, Where::card),
        calls_(what.device, what.most_tiles * sizeof(VkDrawIndirectCommand),
               VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT, Where::upload),
        factor_texels_(texels(what.device, factors_, VK_FORMAT_R32_UINT)),
        edge_texels_(texels(what.device, edges_, VK_FORMAT_R32_UINT)) {
    for (const VkDescriptorSet set : {factor_set_, edge_set_}) {
      bindings_.bind(set, 0, what.frame), bindings_.bind(set, 1, what.draws);
      bindings_.bind(set, 2, what.store.height_texels);
    }
    bindings_.bind(factor_set_, 3, what.store.block_texels), bindings_.bind(factor_set_, 4, factors_);
    bindings_.bind(edge_set_, 3, factor_texels_), bindings_.bind(edge_set_, 4, edges_);
    // Each draw is a tile of its own: 64 blocks, the instance says which tile. One that tessellates more than
    // 65 536 vertices is drawn wrongly by llvmpipe; these have at most 64 * 9 * 17.
    auto* calls = reinterpret_cast<VkDrawIndirectCommand*>(calls_.mapped());
    for (std::uint32_t d = 0; d < what.most_tiles; ++d) calls[d] = {TileStore::kBlocks, 1, 0, d};
  }

  std::vector<GraphicsState::Stage> stages() const override {
    return {{VK_SHADER_STAGE_VERTEX_BIT, shaders::block_vert()},
            {VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT, shaders::block_tesc()},
            {VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT, shaders::block_tese()}};
  }
  VkPrimitiveTopology topology() const override { return VK_PRIMITIVE_TOPOLOGY_PATCH_LIST; }
  const OwnedView& facts() const override { return edge_texels_; }

  std::size_t set(std::span<const DrawGroup> groups) override {
    groups_.assign(groups.begin(), groups.end());
    return 0;
  }
  void record(VkCommandBuffer commands) const override {
    const auto run = [&](const OwnedPipeline& pipeline, VkDescriptorSet set) {
      vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.get());
      vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, bindings_.layout(), 0, 1, &set, 0,
                              nullptr);
      vkCmdDispatch(commands, draws(), 1, 1);
      barrier(commands);
    };
    run(factors_pipeline_, factor_set_);
    run(edges_pipeline_, edge_set_);
  }
  std::size_t dispatches() const override { return 2; }
  void draw(VkCommandBuffer commands, std::size_t group) const override {
    const DrawGroup& g = groups_[group];
    vkCmdDrawIndirect(commands, calls_.get(), g.first * sizeof(VkDrawIndirectCommand), g.count,
                      sizeof(VkDrawIndirectCommand));
  }
  std::uint32_t draws() const override {
    return groups_.empty() ? 0 : groups_.back().first + groups_.back().count;
  }

 private:
  Bindings bindings_;
  OwnedPipeline factors_pipeline_, edges_pipeline_;
  VkDescriptorSet factor_set_ = VK_NULL_HANDLE, edge_set_ = VK_NULL_HANDLE;
  OwnedSets factor_sets_, edge_sets_;
  Buffer factors_, edges_, calls_;
  OwnedView factor_texels_, edge_texels_;
  std::vector<DrawGroup> groups_;
};

}  // namespace

std::unique_ptr<Subdivision> make_tessellation(const Subdivided& what) {
  return std::make_unique<Tessellation>(what);
}

}  // namespace patchwork::vk
