// Draws tiles: dispatches say how each block is divided, one indirect call draws all that need the same
// (those with holes, those that an effect cannot matter to), and what is left of the picture is sky.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "blend/vulkan/pipeline_impl.h"
#include "render/tile_seams.h"
#include "render/vulkan/frame_effects_impl.h"
#include "render/vulkan/subdivision_impl.h"
#include "render/vulkan/target_impl.h"
#include "render/vulkan/tile_store_impl.h"

namespace patchwork::vk {

/// terrain.glsl: FrameBlock.
struct FrameBlock {
  float clip[16], sides[4][4], axis[4], right[4], up[4], eye[4], detail[4];
  bool operator==(const FrameBlock&) const = default;
};
static_assert(sizeof(FrameBlock) == 208);

class TerrainPass {
 public:
  TerrainPass(const Device::Impl& device, const TileStore& store, VkRenderPass pass,
              std::uint32_t most_tiles);

  /// What is drawn from now on. REQUIRES: in the order of make_draws; nothing that uses it still runs.
  void set(const FrameBlock& frame, std::span<const TileDraw> draws);
  /// Outside of a render pass: how what was set is divided. Returns how many dispatches that takes.
  std::size_t record_subdivision(VkCommandBuffer commands) const;
  /// How pixels are coloured from now on: pipelines are made when a set of effects is first met. front_only:
  /// without triangles that look away, which the caller knows to be hidden. REQUIRES: as for set.
  void use(const FrameEffects& effects, bool front_only);
  /// Inside of one, after use.
  void record_draws(VkCommandBuffer commands) const;

  std::size_t bytes_set() const { return bytes_set_; }  ///< by the last call
  const Subdivision& subdivision() const { return *subdivision_; }

 private:
  // Of one set of a picture's effects; what was not needed yet is none.
  struct Pipelines {
    std::array<std::array<OwnedPipeline, 2>, 2> ground;  // without and with holes; all triangles, front ones
    std::array<OwnedPipeline, 2> edges;                  // without and with holes
    OwnedPipeline sky;
  };
  Pipelines& pipelines(const FrameEffects& effects, const effects::Set& set);
  const TileStore& store_;
  VkRenderPass pass_;
  Bindings bindings_;
  std::map<std::pair<unsigned long, unsigned long>, Pipelines> pipelines_;  // by the picture's and the set
  std::vector<const OwnedPipeline*> grounds_, edges_;                       // of each group; no edges: none
  const Pipelines* sky_ = nullptr;
  unsigned generation_ = 0;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  OwnedSets sets_;
  Buffer frame_, draws_;
  OwnedView draw_texels_;
  std::unique_ptr<Subdivision> subdivision_;
  std::vector<DrawGroup> groups_;
  std::size_t bytes_set_ = 0;
};

}  // namespace patchwork::vk
