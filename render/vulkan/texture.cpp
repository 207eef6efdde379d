#include <algorithm>

#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

Texture::Texture(const Device::Impl& device, const TextureShape& shape) : shape_(shape) {
  const std::uint32_t layers = std::max(shape.layers, 1u);
  VkImageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO, info.imageType = VK_IMAGE_TYPE_2D;
  info.format = shape.format, info.extent = {shape.width, shape.height, 1};
  info.mipLevels = 1, info.arrayLayers = layers, info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = VK_IMAGE_TILING_OPTIMAL, info.usage = shape.usage;
  VkImage image = VK_NULL_HANDLE;
  device.check(vkCreateImage(device.get(), &info, nullptr, &image), "making an image");
  image_ = OwnedImage(device.get(), image);
  VkMemoryRequirements needs{};
  vkGetImageMemoryRequirements(device.get(), image, &needs);
  memory_ = allocate(device, needs, Where::card);
  device.check(vkBindImageMemory(device.get(), image, memory_.get(), 0), "binding memory");
  VkImageViewCreateInfo view{};
  view.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, view.image = image, view.format = shape.format;
  view.viewType = shape.layers > 0 ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
  view.subresourceRange = all();
  VkImageView made = VK_NULL_HANDLE;
  device.check(vkCreateImageView(device.get(), &view, nullptr, &made), "viewing an image");
  view_ = OwnedImageView(device.get(), made);
}

VkImageSubresourceRange Texture::all() const { return {shape_.aspect, 0, 1, 0, std::max(shape_.layers, 1u)}; }

void Texture::change(VkCommandBuffer commands, VkImageLayout from, VkImageLayout to) const {
  VkImageMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT | VK_ACCESS_MEMORY_READ_BIT;
  barrier.dstAccessMask = barrier.srcAccessMask;
  barrier.oldLayout = from, barrier.newLayout = to;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image_.get(), barrier.subresourceRange = all();
  constexpr VkPipelineStageFlags stages = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
  vkCmdPipelineBarrier(commands, stages, stages, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

OwnedSampler make_sampler(const Device::Impl& device) {
  VkSamplerCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
  info.magFilter = info.minFilter = VK_FILTER_LINEAR;
  info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  VkSampler sampler = VK_NULL_HANDLE;
  device.check(vkCreateSampler(device.get(), &info, nullptr, &sampler), "making a sampler");
  return OwnedSampler(device.get(), sampler);
}

}  // namespace patchwork::vk
