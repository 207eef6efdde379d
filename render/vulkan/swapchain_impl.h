// The images that a window shows in turn.
#pragma once

#include <functional>
#include <vector>

#include "blend/vulkan/buffer_impl.h"

namespace patchwork::vk {

inline void destroy_surface(VkInstance i, VkSurfaceKHR s, const VkAllocationCallbacks* a) {
  vkDestroySurfaceKHR(i, s, a);
}
using OwnedSurface = Handle<VkInstance, VkSurfaceKHR, destroy_surface>;
using OwnedSwapchain = Owned<VkSwapchainKHR, vkDestroySwapchainKHR>;

/// An image that can be copied to, and how its pixels lie in memory: 8 bits a channel, coded as sRGB.
struct Destination {
  VkImage image;
  VkExtent2D size;
  bool blue_first;
};

class Swapchain {
 public:
  /// REQUIRES: the device is open with VK_KHR_swapchain. Throws Error: its queue cannot show on this surface,
  /// or not in 8 bits a channel.
  Swapchain(const Device::Impl& device, OwnedSurface surface);
  ~Swapchain();

  /// Made anew where it no longer fits the surface; 0 x 0 while the window has no area. `wish`: pixels, for
  /// surfaces that take the size of what they show.
  VkExtent2D fit(VkExtent2D wish);
  /// Shows what `compose` records into the next image, which is then ready to be copied to. One submission,
  /// which has ended afterwards. False where the surface changed meanwhile: fit() and try again. REQUIRES:
  /// fit() gave an area.
  bool show(const std::function<void(VkCommandBuffer, const Destination&)>& compose);

 private:
  void choose_format();
  void make(const VkSurfaceCapabilitiesKHR& can, VkExtent2D size);

  const Device::Impl& device_;
  OwnedSurface surface_;
  VkSurfaceFormatKHR format_{};
  OwnedSwapchain chain_;
  VkExtent2D size_{};
  std::vector<VkImage> images_;
  Commands commands_;
  OwnedFence acquired_;
  bool stale_ = true;
};

}  // namespace patchwork::vk
