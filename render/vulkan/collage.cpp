#include "render/vulkan/collage_impl.h"

#include <algorithm>

namespace patchwork::vk {

namespace {

std::uint32_t coded(const Color& c, bool blue_first) {
  const std::uint32_t first = blue_first ? c.b : c.r, third = blue_first ? c.r : c.b;
  return first | std::uint32_t(c.g) << 8 | third << 16 | 0xff000000u;
}

}  // namespace

void Collage::put(VkCommandBuffer commands, const Panel& panel, const Destination& to, Buffer& pixels) {
  const Image& from = panel.image;
  const int x = panel.x >= 0 ? panel.x : int(to.size.width) + panel.x - from.width + 1;
  const int y = panel.y >= 0 ? panel.y : int(to.size.height) + panel.y - from.height + 1;
  const int left = std::max(x, 0), right = std::min(x + from.width, int(to.size.width));
  const int top = std::max(y, 0), bottom = std::min(y + from.height, int(to.size.height));
  if (left >= right || top >= bottom) return;
  const VkDeviceSize bytes = 4 * VkDeviceSize(right - left) * VkDeviceSize(bottom - top);
  if (pixels.bytes() < bytes) pixels = Buffer(device_, bytes, 0, Where::upload);
  auto* out = reinterpret_cast<std::uint32_t*>(pixels.mapped());
  for (int r = top; r < bottom; ++r)
    for (int c = left; c < right; ++c) *out++ = coded(from.at(c - x, r - y), to.blue_first);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageOffset = {left, top, 0};
  region.imageExtent = {std::uint32_t(right - left), std::uint32_t(bottom - top), 1};
  vkCmdCopyBufferToImage(commands, pixels.get(), to.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
}

// Of equal size but for the moment in which the window changes its own.
void Collage::record(VkCommandBuffer commands, const Target& from, std::span<const Panel> panels,
                     const Destination& to) {
  VkImageBlit region{};
  region.srcSubresource = region.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.srcOffsets[1] = {int(from.size().width), int(from.size().height), 1};
  region.dstOffsets[1] = {int(to.size.width), int(to.size.height), 1};
  vkCmdBlitImage(commands, from.color().get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.image,
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region, VK_FILTER_NEAREST);
  if (pixels_.size() < panels.size()) pixels_.resize(panels.size());
  for (std::size_t k = 0; k < panels.size(); ++k) {
    barrier(commands);  // it lies over what is there
    put(commands, panels[k], to, pixels_[k]);
  }
}

}  // namespace patchwork::vk
