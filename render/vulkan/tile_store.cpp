#include "render/vulkan/tile_store_impl.h"

#include <algorithm>
#include <cstdint>

#include "db/error.h"
#include "render/vulkan/subdivision_impl.h"

namespace patchwork::vk {

namespace {

constexpr VkBufferUsageFlags kUsage =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;

constexpr std::size_t kHalfCells = 4 * TileLattice::kSamples * TileLattice::kSamples;  // pairs of half floats
constexpr std::size_t kIndexBytes = kMostTriangles * 12;
constexpr std::size_t kLeastSlots = 16;

// Two texels of tile_finish.comp; or kBlock of mesh_codes.glsl.
std::size_t block_bytes(const TileStore::Holds& holds) { return holds.meshes ? 7 * 16 : 2 * 16; }

Texture half_cells(const Device::Impl& device, std::uint32_t slots) {
  Texture t(device, {.format = VK_FORMAT_R16G16_SFLOAT,
                     .width = TileLattice::kSamples,
                     .height = TileLattice::kSamples,
                     .layers = slots,
                     .usage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT});
  Commands commands(device);
  t.change(commands.begin(), VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_GENERAL);
  commands.submit(), commands.wait();
  return t;
}

}  // namespace

std::uint32_t TileStore::slots_within(const Device::Impl& device, std::size_t bytes, const Holds& holds) {
  const VkPhysicalDeviceLimits& limits = device.properties.limits;
  const std::size_t slot = 4 * kHeights + kHalfCells + holds.knowledge * kHalfCells +
                           block_bytes(holds) * kBlocks + holds.meshes * kIndexBytes;
  const std::size_t most =
      std::min<std::size_t>({limits.maxImageArrayLayers, limits.maxTexelBufferElements / kHeights,
                             holds.meshes ? limits.maxStorageBufferRange / kIndexBytes : SIZE_MAX});
  if (most < kLeastSlots) throw Error(device.name, "its buffers are too small for the tiles of a picture");
  return std::uint32_t(std::clamp<std::size_t>(bytes / slot, kLeastSlots, most));
}

TileStore::TileStore(const Device::Impl& device, std::uint32_t n, const Holds& what)
    : holds(what),
      slots(n),
      heights(device, 4 * kHeights * n, kUsage, Where::card),
      blocks(device, block_bytes(what) * kBlocks * n, kUsage, Where::card),
      height_texels(texels(device, heights, VK_FORMAT_R32_SFLOAT)),
      block_texels(texels(device, blocks, VK_FORMAT_R32G32B32A32_UINT)),
      slopes(half_cells(device, n)),
      sampler(make_sampler(device)) {
  if (what.knowledge) knowledge = half_cells(device, n);
}

}  // namespace patchwork::vk
