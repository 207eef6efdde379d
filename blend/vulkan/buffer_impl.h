// Memory on the card and the ways to and from it.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "blend/vulkan/device_impl.h"

namespace patchwork::vk {

enum class Where {
  card,     ///< fast for shaders, not mapped
  upload,   ///< mapped, written by the host
  readback  ///< mapped, read by the host
};

/// Throws Error: out of memory, no memory of that kind.
OwnedMemory allocate(const Device::Impl& device, const VkMemoryRequirements& needs, Where where);

/// A buffer with memory of its own. There are some tens of them, all long-lived: nothing is gained by sharing
/// memory between them.
class Buffer {
 public:
  Buffer() = default;
  /// Throws Error: out of memory.
  Buffer(const Device::Impl& device, VkDeviceSize bytes, VkBufferUsageFlags usage, Where where);
  VkBuffer get() const { return buffer_.get(); }
  VkDeviceSize bytes() const { return bytes_; }
  std::byte* mapped() const { return mapped_; }

 private:
  OwnedMemory memory_;
  OwnedBuffer buffer_;
  VkDeviceSize bytes_ = 0;
  std::byte* mapped_ = nullptr;
};

/// A buffer seen as texels: on lavapipe a load from one is a vector gather, from a storage buffer a loop over
/// lanes.
OwnedView texels(const Device::Impl& device, const Buffer& buffer, VkFormat format);

/// One command buffer, submitted and waited for again and again.
class Commands {
 public:
  explicit Commands(const Device::Impl& device);
  ~Commands() { abandon(); }
  /// Waits for what was submitted last, then starts anew.
  VkCommandBuffer begin();
  void submit();
  void wait();  ///< throws Error: the device was lost
  /// Waits whatever becomes of the device: what the commands use may go afterwards.
  void abandon() noexcept;
  VkCommandBuffer get() const { return commands_; }

 private:
  const Device::Impl& device_;
  OwnedCommands pool_;
  OwnedFence fence_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  bool running_ = false;
};

/// Everything before is seen by everything after, on the card and by the host.
void barrier(VkCommandBuffer commands);

/// Sends small pieces through two staging halves: one is filled while the other is copied.
class UploadRing {
 public:
  UploadRing(const Device::Impl& device, VkDeviceSize bytes);
  /// REQUIRES: at most half of the ring; offset and size are multiples of 4.
  void write(const Buffer& to, VkDeviceSize offset, std::span<const std::byte> bytes);
  /// Submits what was written; later submissions see it.
  void flush();

 private:
  struct Half {
    Buffer staging;
    Commands commands;
    VkDeviceSize used = 0;
  };
  std::array<Half, 2> halves_;
  std::size_t at_ = 0;
};

}  // namespace patchwork::vk
