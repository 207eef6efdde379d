// One owner for every kind of Vulkan handle.
#pragma once

#include <vulkan/vulkan.h>

#include <utility>

namespace patchwork::vk {

/// Destroys its handle with the parent it came from; moves by swap.
template <class Parent, class T, void (*destroy)(Parent, T, const VkAllocationCallbacks*)>
class Handle {
 public:
  Handle() = default;
  Handle(Parent parent, T handle) : parent_(parent), handle_(handle) {}
  ~Handle() {
    if (handle_) destroy(parent_, handle_, nullptr);
  }
  Handle(Handle&& o) noexcept { swap(o); }
  Handle& operator=(Handle&& o) noexcept {
    swap(o);
    return *this;
  }
  void swap(Handle& o) noexcept { std::swap(parent_, o.parent_), std::swap(handle_, o.handle_); }
  T get() const { return handle_; }
  explicit operator bool() const { return handle_ != VK_NULL_HANDLE; }

 private:
  Parent parent_{};
  T handle_{};
};

struct NoParent {};
inline void destroy_instance(NoParent, VkInstance i, const VkAllocationCallbacks* a) {
  vkDestroyInstance(i, a);
}
inline void destroy_device(NoParent, VkDevice d, const VkAllocationCallbacks* a) { vkDestroyDevice(d, a); }
/// An extension's function: the loader has no symbol of it.
inline void destroy_messenger(VkInstance i, VkDebugUtilsMessengerEXT m, const VkAllocationCallbacks* a) {
  const auto f = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(i, "vkDestroyDebugUtilsMessengerEXT"));
  if (f) f(i, m, a);
}

using Instance = Handle<NoParent, VkInstance, destroy_instance>;
using Messenger = Handle<VkInstance, VkDebugUtilsMessengerEXT, destroy_messenger>;
using LogicalDevice = Handle<NoParent, VkDevice, destroy_device>;
template <class T, void (*destroy)(VkDevice, T, const VkAllocationCallbacks*)>
using Owned = Handle<VkDevice, T, destroy>;
using OwnedBuffer = Owned<VkBuffer, vkDestroyBuffer>;
using OwnedView = Owned<VkBufferView, vkDestroyBufferView>;
using OwnedMemory = Owned<VkDeviceMemory, vkFreeMemory>;
using OwnedCommands = Owned<VkCommandPool, vkDestroyCommandPool>;
using OwnedFence = Owned<VkFence, vkDestroyFence>;
using OwnedQueries = Owned<VkQueryPool, vkDestroyQueryPool>;
using OwnedShader = Owned<VkShaderModule, vkDestroyShaderModule>;
using OwnedSetLayout = Owned<VkDescriptorSetLayout, vkDestroyDescriptorSetLayout>;
using OwnedLayout = Owned<VkPipelineLayout, vkDestroyPipelineLayout>;
using OwnedSets = Owned<VkDescriptorPool, vkDestroyDescriptorPool>;
using OwnedImage = Owned<VkImage, vkDestroyImage>;
using OwnedImageView = Owned<VkImageView, vkDestroyImageView>;
using OwnedSampler = Owned<VkSampler, vkDestroySampler>;
using OwnedRenderPass = Owned<VkRenderPass, vkDestroyRenderPass>;
using OwnedFramebuffer = Owned<VkFramebuffer, vkDestroyFramebuffer>;
using OwnedPipeline = Owned<VkPipeline, vkDestroyPipeline>;

}  // namespace patchwork::vk
