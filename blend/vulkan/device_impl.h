// What the parts of the Vulkan layer know of the device.
#pragma once

#include <map>
#include <mutex>
#include <utility>

#include "blend/vulkan/device.h"
#include "blend/vulkan/handle_impl.h"

namespace patchwork {

namespace vk {
class Passes;
}

struct Device::Impl {
  // Messages come from any thread that calls Vulkan; declared first, because the messenger writes here last.
  std::mutex mutex;
  std::vector<std::string> messages;

  vk::Instance instance;
  vk::Messenger messenger;
  VkPhysicalDevice physical = VK_NULL_HANDLE;
  VkPhysicalDeviceProperties properties{};
  VkPhysicalDeviceMemoryProperties memory{};
  VkPhysicalDeviceFeatures features{};  // that are switched on
  std::string cannot_draw;              // why it only computes; empty: it draws
  std::uint32_t family = 0;
  vk::LogicalDevice device;
  VkQueue queue = VK_NULL_HANDLE;
  std::string name;
  /// Compiled once: by smoothness and, true, priority.
  std::map<std::pair<int, bool>, std::shared_ptr<vk::Passes>> passes;

  /// Throws Error with the name of what went wrong; `what` is the step that failed.
  void check(VkResult result, const char* what) const;
  VkDevice get() const { return device.get(); }
};

namespace vk {

/// What a result means to a person, e.g. "the device was lost".
std::string meaning(VkResult result);

}  // namespace vk

}  // namespace patchwork
