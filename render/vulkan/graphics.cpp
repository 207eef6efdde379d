#include "render/vulkan/graphics_impl.h"

#include "db/error.h"

namespace patchwork::vk {

namespace {

// The parts of a pipeline that are the same for all.
struct Fixed {
  VkPipelineVertexInputStateCreateInfo vertices{};
  VkPipelineTessellationStateCreateInfo tessellation{};
  VkPipelineViewportStateCreateInfo viewport{};
  VkPipelineMultisampleStateCreateInfo samples{};
  VkPipelineColorBlendAttachmentState written{};
  VkPipelineColorBlendStateCreateInfo colors{};
  VkPipelineDynamicStateCreateInfo dynamic{};
  VkDynamicState set_later[2] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};

  Fixed() {
    vertices.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
    tessellation.sType = VK_STRUCTURE_TYPE_PIPELINE_TESSELLATION_STATE_CREATE_INFO;
    tessellation.patchControlPoints = 1;
    viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
    viewport.viewportCount = viewport.scissorCount = 1;
    samples.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
    samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
    written.colorWriteMask = 0xf;
    colors.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
    colors.attachmentCount = 1, colors.pAttachments = &written;
    dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
    dynamic.dynamicStateCount = 2, dynamic.pDynamicStates = set_later;
  }
};

}  // namespace

OwnedPipeline make_graphics(const Bindings& bindings, VkRenderPass pass, const GraphicsState& state) {
  const Device::Impl& device = bindings.device();
  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t c = 0; c < state.constants.size(); ++c) entries.push_back({c, c * 4, 4});
  const VkSpecializationInfo special{std::uint32_t(entries.size()), entries.data(),
                                     state.constants.size_bytes(), state.constants.data()};
  std::vector<OwnedShader> modules;
  std::vector<VkPipelineShaderStageCreateInfo> stages;
  for (const GraphicsState::Stage& s : state.stages) {
    modules.push_back(make_shader(device, s.shader));
    VkPipelineShaderStageCreateInfo stage{};
    stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    stage.stage = s.stage, stage.module = modules.back().get(), stage.pName = "main";
    stage.pSpecializationInfo = &special;
    stages.push_back(stage);
  }
  if (state.lines && !device.features.fillModeNonSolid)
    throw Error(device.name, "it cannot draw the edges of triangles", "leave out the wireframe");
  const Fixed fixed;
  VkPipelineInputAssemblyStateCreateInfo assembly{};
  assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
  assembly.topology = state.topology;
  VkPipelineRasterizationStateCreateInfo raster{};
  raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO, raster.lineWidth = 1;
  raster.polygonMode = state.lines ? VK_POLYGON_MODE_LINE : VK_POLYGON_MODE_FILL;
  raster.cullMode = state.front_only ? VK_CULL_MODE_BACK_BIT : VK_CULL_MODE_NONE;
  raster.frontFace = VK_FRONT_FACE_COUNTER_CLOCKWISE;
  // Edges lie a little nearer than the triangles that they belong to.
  raster.depthBiasEnable = state.lines, raster.depthBiasConstantFactor = 64;
  VkPipelineDepthStencilStateCreateInfo depth{};
  depth.sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO;
  depth.depthTestEnable = VK_TRUE, depth.depthWriteEnable = state.depth_write;
  depth.depthCompareOp = state.compare;
  VkGraphicsPipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
  info.stageCount = std::uint32_t(stages.size()), info.pStages = stages.data();
  info.pVertexInputState = &fixed.vertices, info.pInputAssemblyState = &assembly;
  if (state.topology == VK_PRIMITIVE_TOPOLOGY_PATCH_LIST) info.pTessellationState = &fixed.tessellation;
  info.pViewportState = &fixed.viewport, info.pRasterizationState = &raster;
  info.pMultisampleState = &fixed.samples, info.pDepthStencilState = &depth;
  info.pColorBlendState = &fixed.colors, info.pDynamicState = &fixed.dynamic;
  info.layout = bindings.layout(), info.renderPass = pass;
  VkPipeline pipeline = VK_NULL_HANDLE;
  device.check(vkCreateGraphicsPipelines(device.get(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline),
               "making a pipeline");
  return OwnedPipeline(device.get(), pipeline);
}

}  // namespace patchwork::vk
