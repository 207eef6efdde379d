// Graphics pipelines.
#pragma once

#include <span>
#include <vector>

#include "blend/vulkan/pipeline_impl.h"

namespace patchwork::vk {

/// What differs between the pipelines of this renderer: all draw without vertex buffers.
struct GraphicsState {
  struct Stage {
    VkShaderStageFlagBits stage;
    std::span<const std::uint32_t> shader;
  };
  std::vector<Stage> stages;
  std::span<const std::uint32_t> constants = {};  ///< specialization constants 0, 1, ... of all stages
  VkPrimitiveTopology topology = VK_PRIMITIVE_TOPOLOGY_PATCH_LIST;
  bool depth_write = true;
  VkCompareOp compare = VK_COMPARE_OP_GREATER;
  bool lines = false;       ///< edges of triangles only
  bool front_only = false;  ///< no triangles that are clockwise in the picture
};

/// Viewport and scissor are set by commands.
OwnedPipeline make_graphics(const Bindings& bindings, VkRenderPass pass, const GraphicsState& state);

}  // namespace patchwork::vk
