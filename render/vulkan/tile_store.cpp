#include "render/vulkan/tile_store_impl.h"

#include <algorithm>

namespace patchwork::vk {

namespace {

constexpr VkBufferUsageFlags kUsage =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;

}  // namespace

std::uint32_t TileStore::slots_within(const Device::Impl& device, std::size_t bytes) {
  const VkPhysicalDeviceLimits& limits = device.properties.limits;
  const std::size_t most = std::min<std::size_t>(
      {bytes / kSlotBytes, limits.maxImageArrayLayers, limits.maxTexelBufferElements / kHeights});
  return std::uint32_t(std::max<std::size_t>(most, 16));
}

TileStore::TileStore(const Device::Impl& device, std::uint32_t n)
    : slots(n),
      heights(device, 4 * kHeights * n, kUsage, Where::card),
      blocks(device, 32 * kBlocks * n, kUsage, Where::card),
      height_texels(texels(device, heights, VK_FORMAT_R32_SFLOAT)),
      block_texels(texels(device, blocks, VK_FORMAT_R32G32B32A32_SFLOAT)),
      slopes(device, {.format = VK_FORMAT_R16G16_SFLOAT,
                      .width = TileLattice::kSamples,
                      .height = TileLattice::kSamples,
                      .layers = n,
                      .usage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT}),
      sampler(make_sampler(device)) {
  Commands commands(device);
  slopes.change(commands.begin(), VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_GENERAL);
  commands.submit(), commands.wait();
}

}  // namespace patchwork::vk
