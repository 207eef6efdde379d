// A picture of the renderer and panels over it, put together on the card.
#pragma once

#include <span>
#include <vector>

#include "render/vulkan/swapchain_impl.h"
#include "render/vulkan/target_impl.h"
#include "render/window.h"

namespace patchwork::vk {

class Collage {
 public:
  explicit Collage(const Device::Impl& device) : device_(device) {}
  /// `to` is ready to be copied to; all of it is filled. REQUIRES: what was recorded before has ended.
  void record(VkCommandBuffer commands, const Target& from, std::span<const Panel> panels,
              const Destination& to);

 private:
  void put(VkCommandBuffer commands, const Panel& panel, const Destination& to, Buffer& pixels);
  const Device::Impl& device_;
  std::vector<Buffer> pixels_;  // of each panel
};

}  // namespace patchwork::vk
