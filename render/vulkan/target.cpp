#include "render/vulkan/target_impl.h"

#include <cmath>

namespace patchwork::vk {

namespace {

VkAttachmentDescription attachment(VkFormat format) {
  VkAttachmentDescription a{};
  a.format = format, a.samples = VK_SAMPLE_COUNT_1_BIT;
  a.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR, a.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  a.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE, a.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  a.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED, a.finalLayout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  return a;
}

// All that came before is awaited, and all that comes after waits for the pass.
VkSubpassDependency dependency(std::uint32_t from, std::uint32_t to) {
  VkSubpassDependency d{};
  d.srcSubpass = from, d.dstSubpass = to;
  const auto stages = [](std::uint32_t at) -> VkPipelineStageFlags {
    return at == VK_SUBPASS_EXTERNAL ? VK_PIPELINE_STAGE_ALL_COMMANDS_BIT
                                     : VK_PIPELINE_STAGE_ALL_GRAPHICS_BIT;
  };
  d.srcStageMask = stages(from), d.dstStageMask = stages(to);
  d.srcAccessMask = d.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  return d;
}

OwnedRenderPass make_pass(const Device::Impl& device) {
  const VkAttachmentDescription attachments[] = {attachment(Target::kColor), attachment(Target::kDepth)};
  const VkAttachmentReference color{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
  const VkAttachmentReference depth{1, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1, subpass.pColorAttachments = &color;
  subpass.pDepthStencilAttachment = &depth;
  const VkSubpassDependency around[] = {dependency(VK_SUBPASS_EXTERNAL, 0),
                                        dependency(0, VK_SUBPASS_EXTERNAL)};
  VkRenderPassCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO;
  info.attachmentCount = 2, info.pAttachments = attachments;
  info.subpassCount = 1, info.pSubpasses = &subpass;
  info.dependencyCount = 2, info.pDependencies = around;
  VkRenderPass pass = VK_NULL_HANDLE;
  device.check(vkCreateRenderPass(device.get(), &info, nullptr, &pass), "describing a render pass");
  return OwnedRenderPass(device.get(), pass);
}

}  // namespace

Target::Target(const Device::Impl& device, std::uint32_t width, std::uint32_t height)
    : pass_(make_pass(device)) {
  resize(device, width, height);
}

// What is old goes first: its memory may be what the new one takes.
void Target::resize(const Device::Impl& device, std::uint32_t width, std::uint32_t height) {
  framebuffer_ = {}, color_ = {}, depth_ = {}, color_out_ = {}, depth_out_ = {};
  color_ = Texture(device, {.format = kColor,
                            .width = width,
                            .height = height,
                            .usage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT});
  depth_ =
      Texture(device, {.format = kDepth,
                       .width = width,
                       .height = height,
                       .usage = VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                       .aspect = VK_IMAGE_ASPECT_DEPTH_BIT});
  const VkImageView views[] = {color_.view(), depth_.view()};
  VkFramebufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO, info.renderPass = pass_.get();
  info.attachmentCount = 2, info.pAttachments = views;
  info.width = width, info.height = height, info.layers = 1;
  VkFramebuffer framebuffer = VK_NULL_HANDLE;
  device.check(vkCreateFramebuffer(device.get(), &info, nullptr, &framebuffer), "making a framebuffer");
  framebuffer_ = OwnedFramebuffer(device.get(), framebuffer);
  const VkDeviceSize bytes = VkDeviceSize{4} * width * height;
  color_out_ = Buffer(device, bytes, 0, Where::readback);
  depth_out_ = Buffer(device, bytes, 0, Where::readback);
}

void Target::begin(VkCommandBuffer commands, const float (&background)[4]) const {
  VkClearValue clear[2] = {};
  for (int k = 0; k < 4; ++k) clear[0].color.float32[k] = background[k];
  VkRenderPassBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO;
  info.renderPass = pass_.get(), info.framebuffer = framebuffer_.get();
  info.renderArea.extent = size(), info.clearValueCount = 2, info.pClearValues = clear;
  vkCmdBeginRenderPass(commands, &info, VK_SUBPASS_CONTENTS_INLINE);
  const VkViewport viewport{0, 0, float(size().width), float(size().height), 0, 1};
  const VkRect2D scissor{{0, 0}, size()};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &scissor);
}

void Target::read_back(VkCommandBuffer commands, bool color, bool depth) {
  const auto copy = [&](const Texture& image, const Buffer& to) {
    VkBufferImageCopy region{};
    region.imageSubresource = {image.shape().aspect, 0, 0, 1};
    region.imageExtent = {size().width, size().height, 1};
    vkCmdCopyImageToBuffer(commands, image.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.get(), 1, &region);
  };
  if (color) copy(color_, color_out_);
  if (depth) copy(depth_, depth_out_);
  barrier(commands);
}

std::vector<float> Target::metres(Camera camera, double near) const {
  camera.width = int(size().width), camera.height = int(size().height);
  std::vector<float> metres;
  metres.reserve(std::size_t(camera.width) * std::size_t(camera.height));
  const float* from = depths();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x, ++from)
      metres.push_back(
          *from > 0 ? float(axial_of_depth(double(*from), near) / axial_share(camera, x + 0.5, y + 0.5))
                    : NAN);
  return metres;
}

}  // namespace patchwork::vk
