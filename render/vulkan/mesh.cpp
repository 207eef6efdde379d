// Blocks as one mesh of all tiles: compute shaders write the triangles of just the vertices that errors ask
// for.
#include "render/vulkan/shaders.h"
#include "render/vulkan/subdivision_impl.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr VkDescriptorType kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
// terrain.glsl, needs.comp, mesh_edges.comp, triangles.comp
constexpr VkDescriptorType kTypes[] = {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER,
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
                                       kStorage,   // calls
                                       kStorage};  // groups
constexpr std::uint32_t kPush = 4;                 // triangles.comp
constexpr VkBufferUsageFlags kWordTexels =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
constexpr std::size_t kBlockTexel = TileStore::kBlocks * 16;  // bytes of a tile: one texel a block
using Call = VkDrawIndexedIndirectCommand;
struct First {  // of a group's draws, and of those behind them
  std::uint32_t draw, end;
};

// mesh.glsl: draw_named, half_cells_named.
MeshVertex named(std::uint32_t n) {
  return {n >> 16, std::int32_t((n >> 8 & 7) << 5 | (n & 15) << 1 | (n >> 14 & 1)),
          std::int32_t((n >> 11 & 7) << 5 | (n >> 4 & 15) << 1 | (n >> 15 & 1))};
}

class Mesh : public Subdivision {
 public:
  explicit Mesh(const Subdivided& what)
      : bindings_(what.device, kTypes, kPush),
        needs_pipeline_(make_pipeline(bindings_, shaders::needs(), {})),
        edges_pipeline_(make_pipeline(bindings_, shaders::mesh_edges(), {})),
        triangles_pipeline_(make_pipeline(bindings_, shaders::triangles(), {})),
        sets_(bindings_.make_set(set_)),
        needs_(what.device, what.most_tiles * kBlockTexel, kWordTexels, Where::card),
        edges_(what.device, what.most_tiles * kBlockTexel, kWordTexels, Where::card),
        counts_(what.device, what.most_tiles * 4, kWordTexels, Where::card),
        calls_(what.device, kMostGroups * sizeof(Call),
               VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, Where::upload),
        firsts_(what.device, kMostGroups * sizeof(First), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, Where::upload),
        need_texels_(texels(what.device, needs_, VK_FORMAT_R32G32B32A32_UINT)),
        edge_texels_(texels(what.device, edges_, VK_FORMAT_R32G32B32A32_UINT)),
        count_texels_(texels(what.device, counts_, VK_FORMAT_R32_UINT)) {
    const auto bind = [&](std::uint32_t at, const auto& to) { bindings_.bind(set_, at, to); };
    bind(0, what.frame), bind(1, what.draws), bind(2, what.store.height_texels);
    bind(3, what.store.block_texels), bind(4, needs_), bind(5, need_texels_), bind(6, edges_);
    bind(7, edge_texels_), bind(8, counts_), bind(9, count_texels_), bind(11, calls_), bind(12, firsts_);
  }

  std::vector<GraphicsState::Stage> stages() const override {
    return {{VK_SHADER_STAGE_VERTEX_BIT, shaders::mesh_vert()}};
  }
  VkPrimitiveTopology topology() const override { return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST; }
  const OwnedView& facts() const override { return need_texels_; }

  std::size_t set(std::span<const DrawGroup> groups) override {
    groups_ = std::uint32_t(groups.size());
    tiles_ = groups.empty() ? 0 : groups.back().first + groups.back().count;
    reserve(tiles_ * kMostTriangles * 12);
    // Which indices are theirs comes from triangles.comp.
    auto* calls = reinterpret_cast<Call*>(calls_.mapped());
    auto* firsts = reinterpret_cast<First*>(firsts_.mapped());
    for (std::size_t g = 0; g < groups.size(); ++g)
      calls[g] = {0, 1, 0, 0, 0}, firsts[g] = {groups[g].first, groups[g].first + groups[g].count};
    return groups_ * (sizeof(Call) + sizeof(First));
  }
  void record(VkCommandBuffer commands) const override {
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, bindings_.layout(), 0, 1, &set_, 0,
                            nullptr);
    vkCmdPushConstants(commands, bindings_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, kPush, &groups_);
    for (const OwnedPipeline* p : {&needs_pipeline_, &edges_pipeline_, &triangles_pipeline_}) {
      vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, p->get());
      vkCmdDispatch(commands, tiles_, 1, 1);
      barrier(commands);
    }
  }
  std::size_t dispatches() const override { return 3; }
  void draw(VkCommandBuffer commands, std::size_t group) const override {
    vkCmdBindIndexBuffer(commands, indices_.get(), 0, VK_INDEX_TYPE_UINT32);
    vkCmdDrawIndexedIndirect(commands, calls_.get(), group * sizeof(Call), 1, 0);
  }
  std::uint32_t draws() const override { return groups_; }

  std::vector<MeshVertex> read_mesh(Commands& commands) const override {
    std::vector<MeshVertex> mesh;
    if (tiles_ == 0) return mesh;
    const Buffer to(bindings_.device(), indices_.bytes(), VK_BUFFER_USAGE_TRANSFER_DST_BIT, Where::readback);
    const VkCommandBuffer c = commands.begin();
    const VkBufferCopy all{0, 0, indices_.bytes()};
    vkCmdCopyBuffer(c, indices_.get(), to.get(), 1, &all);
    barrier(c);
    commands.submit(), commands.wait();
    const auto* names = reinterpret_cast<const std::uint32_t*>(to.mapped());
    const auto* calls = reinterpret_cast<const Call*>(calls_.mapped());
    for (std::uint32_t k = 0; k < groups_; ++k)
      for (std::uint32_t v = 0; v < calls[k].indexCount; ++v)
        mesh.push_back(named(names[calls[k].firstIndex + v]));
    return mesh;
  }

 private:
  // Room for the most triangles that so many tiles may have: counted by TileStore::slots_within.
  void reserve(std::size_t bytes) {
    if (bytes <= indices_.bytes()) return;
    indices_ = Buffer();
    indices_ = Buffer(bindings_.device(), bytes,
                      VK_BUFFER_USAGE_INDEX_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT |
                          VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                      Where::card);
    bindings_.bind(set_, 10, indices_);
  }

  Bindings bindings_;
  OwnedPipeline needs_pipeline_, edges_pipeline_, triangles_pipeline_;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  OwnedSets sets_;
  Buffer needs_, edges_, counts_, calls_, firsts_, indices_;
  OwnedView need_texels_, edge_texels_, count_texels_;
  std::uint32_t tiles_ = 0, groups_ = 0;
};

}  // namespace

std::unique_ptr<Subdivision> make_mesh(const Subdivided& what) { return std::make_unique<Mesh>(what); }

}  // namespace patchwork::vk
