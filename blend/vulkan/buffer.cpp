#include <algorithm>
#include <cassert>
#include <cstring>

#include "blend/vulkan/buffer_impl.h"
#include "db/error.h"

namespace patchwork::vk {

namespace {

VkMemoryPropertyFlags wanted(Where where) {
  VkMemoryPropertyFlags flags = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  if (where != Where::card)
    flags = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  if (where == Where::readback) flags |= VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
  return flags;
}

// The first type with all that is wanted; cached memory is a wish, the rest is not.
std::uint32_t memory_type(const Device::Impl& device, std::uint32_t allowed, Where where) {
  for (VkMemoryPropertyFlags flags :
       {wanted(where), wanted(where) & ~VkMemoryPropertyFlags{VK_MEMORY_PROPERTY_HOST_CACHED_BIT}})
    for (std::uint32_t t = 0; t < device.memory.memoryTypeCount; ++t)
      if (allowed >> t & 1 && (device.memory.memoryTypes[t].propertyFlags & flags) == flags) return t;
  throw Error(device.name, "it has no memory of a kind that is needed");
}

}  // namespace

OwnedMemory allocate(const Device::Impl& device, const VkMemoryRequirements& needs, Where where) {
  VkMemoryAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, allocate.allocationSize = needs.size;
  allocate.memoryTypeIndex = memory_type(device, needs.memoryTypeBits, where);
  VkDeviceMemory memory = VK_NULL_HANDLE;
  device.check(vkAllocateMemory(device.get(), &allocate, nullptr, &memory), "taking memory");
  return OwnedMemory(device.get(), memory);
}

// Every buffer can be copied from and to; what is mapped stays so.
Buffer::Buffer(const Device::Impl& device, VkDeviceSize bytes, VkBufferUsageFlags usage, Where where)
    : bytes_(std::max<VkDeviceSize>(bytes, 64)) {
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, info.size = bytes_;
  info.usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  device.check(vkCreateBuffer(device.get(), &info, nullptr, &buffer), "making a buffer");
  buffer_ = OwnedBuffer(device.get(), buffer);
  VkMemoryRequirements needs{};
  vkGetBufferMemoryRequirements(device.get(), buffer, &needs);
  memory_ = allocate(device, needs, where);
  device.check(vkBindBufferMemory(device.get(), buffer, memory_.get(), 0), "binding memory");
  if (where == Where::card) return;
  void* mapped = nullptr;
  device.check(vkMapMemory(device.get(), memory_.get(), 0, VK_WHOLE_SIZE, 0, &mapped), "mapping memory");
  mapped_ = static_cast<std::byte*>(mapped);
}

OwnedView texels(const Device::Impl& device, const Buffer& buffer, VkFormat format) {
  VkBufferViewCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO;
  info.buffer = buffer.get(), info.format = format, info.range = VK_WHOLE_SIZE;
  VkBufferView view = VK_NULL_HANDLE;
  device.check(vkCreateBufferView(device.get(), &info, nullptr, &view), "viewing a buffer");
  return OwnedView(device.get(), view);
}

// A pool of its own, so that threads never share one.
Commands::Commands(const Device::Impl& device) : device_(device) {
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT, pool.queueFamilyIndex = device.family;
  VkCommandPool made = VK_NULL_HANDLE;
  device.check(vkCreateCommandPool(device.get(), &pool, nullptr, &made), "making a command pool");
  pool_ = OwnedCommands(device.get(), made);
  VkCommandBufferAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  allocate.commandPool = made, allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocate.commandBufferCount = 1;
  device.check(vkAllocateCommandBuffers(device.get(), &allocate, &commands_), "making a command buffer");
  VkFenceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  VkFence fence = VK_NULL_HANDLE;
  device.check(vkCreateFence(device.get(), &info, nullptr, &fence), "making a fence");
  fence_ = OwnedFence(device.get(), fence);
}

VkCommandBuffer Commands::begin() {
  wait();
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  device_.check(vkBeginCommandBuffer(commands_, &info), "recording commands");
  return commands_;
}

void Commands::submit() {
  device_.check(vkEndCommandBuffer(commands_), "recording commands");
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1, info.pCommandBuffers = &commands_;
  device_.check(vkQueueSubmit(device_.queue, 1, &info, fence_.get()), "submitting work");
  running_ = true;
}

void Commands::wait() {
  if (!running_) return;
  running_ = false;  // also where waiting fails: a lost device ends nothing
  VkFence fence = fence_.get();
  device_.check(vkWaitForFences(device_.get(), 1, &fence, VK_TRUE, UINT64_MAX), "waiting for the device");
  device_.check(vkResetFences(device_.get(), 1, &fence), "waiting for the device");
}

void Commands::abandon() noexcept {
  const VkFence fence = fence_.get();
  if (running_) vkWaitForFences(device_.get(), 1, &fence, VK_TRUE, UINT64_MAX);
  running_ = false;
}

void barrier(VkCommandBuffer commands) {
  VkMemoryBarrier memory{};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  memory.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT | VK_ACCESS_MEMORY_READ_BIT;
  memory.dstAccessMask = memory.srcAccessMask;
  constexpr VkPipelineStageFlags stages = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
  vkCmdPipelineBarrier(commands, stages, stages | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &memory, 0, nullptr, 0,
                       nullptr);
}

UploadRing::UploadRing(const Device::Impl& device, VkDeviceSize bytes)
    : halves_{Half{Buffer(device, bytes / 2, 0, Where::upload), Commands(device)},
              Half{Buffer(device, bytes / 2, 0, Where::upload), Commands(device)}} {}

void UploadRing::write(const Buffer& to, VkDeviceSize offset, std::span<const std::byte> bytes) {
  assert(bytes.size() <= halves_[0].staging.bytes());
  if (halves_[at_].used + bytes.size() > halves_[at_].staging.bytes()) flush();
  Half& half = halves_[at_];
  // What was submitted before may still read what is overwritten here.
  if (half.used == 0) barrier(half.commands.begin());
  std::memcpy(half.staging.mapped() + half.used, bytes.data(), bytes.size());
  const VkBufferCopy copy{half.used, offset, bytes.size()};
  vkCmdCopyBuffer(half.commands.get(), half.staging.get(), to.get(), 1, &copy);
  half.used += bytes.size();
}

void UploadRing::flush() {
  Half& half = halves_[at_];
  if (half.used == 0) return;
  barrier(half.commands.get());
  half.commands.submit();
  half.used = 0, at_ ^= 1;
}

}  // namespace patchwork::vk
