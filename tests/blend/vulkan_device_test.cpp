// The device: how one is chosen, what is said when none will do, and that its watch is awake.
#include <gtest/gtest.h>

#include "blend/vulkan/buffer_impl.h"
#include "tests/blend/vulkan_scene.h"

namespace patchwork {
namespace {

std::string error_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return {};
}

TEST(VulkanDevice, OneIsThereAndHasAName) {
  EXPECT_FALSE(Device::open()->name().empty());
  EXPECT_GT(Device::open()->most_patches(), 1000u);
}

TEST(VulkanDevice, AChoiceIsANumberOrAPartOfAName) {
  const std::string name = Device::open({.choice = "0"})->name();
  EXPECT_EQ(Device::open({.choice = name.substr(1, 4)})->name(), name);
  setenv("PATCHWORK_DEVICE", "no such card", 1);
  const std::string refused = error_of([] { Device::open(); });
  unsetenv("PATCHWORK_DEVICE");
  EXPECT_NE(refused.find(name), std::string::npos) << "every device is named with its reason: " << refused;
  EXPECT_NE(refused.find("no such card"), std::string::npos);
  EXPECT_NE(error_of([] { Device::open({.choice = "99"}); }), "");
}

TEST(VulkanDevice, TheValidationLayerSpeaks) {
  const auto device = Device::open({.validation = true});
  EXPECT_TRUE(device->messages().empty());
  VkBufferCreateInfo wrong{};
  wrong.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;  // no size, no usage
  VkBuffer buffer = VK_NULL_HANDLE;
  if (vkCreateBuffer(device->impl().get(), &wrong, nullptr, &buffer) == VK_SUCCESS)
    vkDestroyBuffer(device->impl().get(), buffer, nullptr);
  EXPECT_FALSE(device->messages().empty());
}

TEST(VulkanDevice, WhatGoesWrongHasAName) {
  const auto device = Device::open();
  const auto said = [&](VkResult r) { return error_of([&] { device->impl().check(r, "testing"); }); };
  EXPECT_NE(said(VK_ERROR_DEVICE_LOST).find("the device was lost"), std::string::npos);
  EXPECT_NE(said(VK_ERROR_OUT_OF_DEVICE_MEMORY).find("out of memory"), std::string::npos);
  EXPECT_NE(said(VK_ERROR_DEVICE_LOST).find(device->name()), std::string::npos);
  EXPECT_EQ(said(VK_SUCCESS), "");
}

TEST(VulkanDevice, MoreMemoryThanThereIsIsAnError) {
  const auto device = Device::open();
  const std::string said = error_of([&] {
    vk::Buffer(device->impl(), VkDeviceSize{1} << 50, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, vk::Where::card);
  });
  EXPECT_NE(said.find("memory"), std::string::npos) << said;
  const Land scene(surveys());
  EXPECT_THROW(PatchPool(device, scene.db(), device->most_patches() + 1), Error);
}

TEST(VulkanDevice, HandlesMoveBySwapping) {
  const auto device = Device::open();
  vk::Buffer a(device->impl(), 1024, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, vk::Where::upload);
  const VkBuffer handle = a.get();
  vk::Buffer b;
  b = std::move(a);
  EXPECT_EQ(b.get(), handle);
}

}  // namespace
}  // namespace patchwork
