#include "render/vulkan/swapchain_impl.h"

#include <algorithm>

#include "db/error.h"

namespace patchwork::vk {

namespace {

constexpr std::uint64_t kForever = ~std::uint64_t{0};

// From one use of an image to the next.
void change_layout(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to) {
  VkImageMemoryBarrier b{};
  b.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  b.srcAccessMask = b.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
  b.oldLayout = from, b.newLayout = to, b.image = image;
  b.srcQueueFamilyIndex = b.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  b.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  constexpr VkPipelineStageFlags all = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
  vkCmdPipelineBarrier(commands, all, all, 0, 0, nullptr, 0, nullptr, 1, &b);
}

}  // namespace

Swapchain::Swapchain(const Device::Impl& device, OwnedSurface surface)
    : device_(device), surface_(std::move(surface)), commands_(device) {
  VkBool32 shows = VK_FALSE;
  device.check(vkGetPhysicalDeviceSurfaceSupportKHR(device.physical, device.family, surface_.get(), &shows),
               "asking for the screen");
  if (!shows)
    throw Error(device.name, "its queue cannot show on this display",
                "PATCHWORK_DEVICE picks another device");
  choose_format();
  VkFenceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  VkFence fence = VK_NULL_HANDLE;
  device.check(vkCreateFence(device.get(), &info, nullptr, &fence), "making a fence");
  acquired_ = OwnedFence(device.get(), fence);
}

// What is shown may still be used by the screen.
Swapchain::~Swapchain() { vkDeviceWaitIdle(device_.get()); }

// Pictures are coded as sRGB already: a format that coded them once more would wash them out.
void Swapchain::choose_format() {
  std::uint32_t n = 0;
  vkGetPhysicalDeviceSurfaceFormatsKHR(device_.physical, surface_.get(), &n, nullptr);
  std::vector<VkSurfaceFormatKHR> formats(n);
  device_.check(vkGetPhysicalDeviceSurfaceFormatsKHR(device_.physical, surface_.get(), &n, formats.data()),
                "asking for the screen's formats");
  for (const VkFormat wanted : {VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_B8G8R8A8_UNORM})
    for (const VkSurfaceFormatKHR& f : formats)
      if (f.format == wanted && f.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR) {
        format_ = f;
        return;
      }
  throw Error(device_.name, "it does not show 8 bits a channel on this display");
}

VkExtent2D Swapchain::fit(VkExtent2D wish) {
  VkSurfaceCapabilitiesKHR can{};
  device_.check(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(device_.physical, surface_.get(), &can),
                "asking for the window's size");
  VkExtent2D size = can.currentExtent;
  if (size.width == UINT32_MAX)
    size = {std::clamp(wish.width, can.minImageExtent.width, can.maxImageExtent.width),
            std::clamp(wish.height, can.minImageExtent.height, can.maxImageExtent.height)};
  if (size.width == 0 || size.height == 0) return {0, 0};
  if (stale_ || size.width != size_.width || size.height != size_.height) make(can, size);
  return size_;
}

void Swapchain::make(const VkSurfaceCapabilitiesKHR& can, VkExtent2D size) {
  if (!(can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_DST_BIT))
    throw Error(device_.name, "pictures cannot be copied to this display");
  vkDeviceWaitIdle(device_.get());
  VkSwapchainCreateInfoKHR info{};
  info.sType = VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR, info.surface = surface_.get();
  info.minImageCount = can.minImageCount + 1;
  if (can.maxImageCount > 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
  info.imageFormat = format_.format, info.imageColorSpace = format_.colorSpace;
  info.imageExtent = size, info.imageArrayLayers = 1, info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  info.preTransform = can.currentTransform, info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
  if (!(can.supportedCompositeAlpha & info.compositeAlpha))
    info.compositeAlpha = VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
  info.presentMode = VK_PRESENT_MODE_FIFO_KHR, info.clipped = VK_TRUE, info.oldSwapchain = chain_.get();
  VkSwapchainKHR chain = VK_NULL_HANDLE;
  device_.check(vkCreateSwapchainKHR(device_.get(), &info, nullptr, &chain), "preparing the window");
  chain_ = OwnedSwapchain(device_.get(), chain);
  std::uint32_t n = 0;
  vkGetSwapchainImagesKHR(device_.get(), chain, &n, nullptr);
  images_.resize(n);
  device_.check(vkGetSwapchainImagesKHR(device_.get(), chain, &n, images_.data()), "preparing the window");
  size_ = size, stale_ = false;
}

// The host waits for the image and for the copies, so that nothing needs a semaphore: the copies are a small
// part of a frame, and the renderer's next frame would wait for them anyway.
bool Swapchain::show(const std::function<void(VkCommandBuffer, const Destination&)>& compose) {
  std::uint32_t k = 0;
  const VkFence fence = acquired_.get();
  const VkResult got =
      vkAcquireNextImageKHR(device_.get(), chain_.get(), kForever, VK_NULL_HANDLE, fence, &k);
  stale_ = got == VK_ERROR_OUT_OF_DATE_KHR || got == VK_SUBOPTIMAL_KHR;
  if (got == VK_ERROR_OUT_OF_DATE_KHR) return false;
  device_.check(got, "waiting for the screen");
  device_.check(vkWaitForFences(device_.get(), 1, &fence, VK_TRUE, kForever), "waiting for the screen");
  device_.check(vkResetFences(device_.get(), 1, &fence), "waiting for the screen");
  const VkCommandBuffer c = commands_.begin();
  change_layout(c, images_[k], VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  compose(c, {images_[k], size_, format_.format == VK_FORMAT_B8G8R8A8_UNORM});
  change_layout(c, images_[k], VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR);
  commands_.submit(), commands_.wait();
  const VkSwapchainKHR chain = chain_.get();
  VkPresentInfoKHR present{};
  present.sType = VK_STRUCTURE_TYPE_PRESENT_INFO_KHR;
  present.swapchainCount = 1, present.pSwapchains = &chain, present.pImageIndices = &k;
  const VkResult put = vkQueuePresentKHR(device_.queue, &present);
  stale_ |= put == VK_ERROR_OUT_OF_DATE_KHR || put == VK_SUBOPTIMAL_KHR;
  if (put == VK_ERROR_OUT_OF_DATE_KHR) return false;
  device_.check(put, "showing a picture");
  return true;
}

}  // namespace patchwork::vk
