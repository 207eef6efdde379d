// What is drawn into: a colour and a depth image, and the way back to the host.
#pragma once

#include <vector>

#include "render/camera.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

/// Reversed depth in float32: 1 at the near plane, 0 at infinity.
class Target {
 public:
  static constexpr VkFormat kColor = VK_FORMAT_R8G8B8A8_UNORM, kDepth = VK_FORMAT_D32_SFLOAT;
  Target(const Device::Impl& device, std::uint32_t width, std::uint32_t height);

  /// The pass stays, and with it what was made for it. REQUIRES: nothing that uses the images is running.
  void resize(const Device::Impl& device, std::uint32_t width, std::uint32_t height);

  VkRenderPass pass() const { return pass_.get(); }
  VkExtent2D size() const { return {color_.shape().width, color_.shape().height}; }
  const Texture& color() const { return color_; }
  /// Clears both; afterwards the images can be copied from.
  void begin(VkCommandBuffer commands, const float (&background)[4]) const;
  void end(VkCommandBuffer commands) const { vkCmdEndRenderPass(commands); }
  /// Copies an image to memory of the host; what was recorded before is awaited.
  void read_back(VkCommandBuffer commands, bool color, bool depth);
  const std::uint32_t* pixels() const { return reinterpret_cast<const std::uint32_t*>(color_out_.mapped()); }
  const float* depths() const { return reinterpret_cast<const float*>(depth_out_.mapped()); }
  /// The depths, metres along the ray through each pixel's centre, row-major; NaN where there is nothing.
  /// `camera`: as it was drawn with, but for its size; `near`: metres.
  std::vector<float> metres(Camera camera, double near) const;

 private:
  Texture color_, depth_;
  OwnedRenderPass pass_;
  OwnedFramebuffer framebuffer_;
  Buffer color_out_, depth_out_;
};

}  // namespace patchwork::vk
