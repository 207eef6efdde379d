// Images on the card.
#pragma once

#include "blend/vulkan/buffer_impl.h"

namespace patchwork::vk {

struct TextureShape {
  VkFormat format = VK_FORMAT_R8G8B8A8_UNORM;
  std::uint32_t width = 1, height = 1, layers = 0;  ///< layers 0: a plain image, else an array
  VkImageUsageFlags usage = 0;
  VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT;
};

/// An image with memory of its own and a view of all of it.
class Texture {
 public:
  Texture() = default;
  /// Throws Error: out of memory.
  Texture(const Device::Impl& device, const TextureShape& shape);
  VkImage get() const { return image_.get(); }
  VkImageView view() const { return view_.get(); }
  const TextureShape& shape() const { return shape_; }
  VkImageSubresourceRange all() const;
  /// Everything before is seen by everything after, in the new layout.
  void change(VkCommandBuffer commands, VkImageLayout from, VkImageLayout to) const;

 private:
  TextureShape shape_;
  OwnedMemory memory_;
  OwnedImage image_;
  OwnedImageView view_;
};

/// Linear, clamped to the edges.
OwnedSampler make_sampler(const Device::Impl& device);

}  // namespace patchwork::vk
