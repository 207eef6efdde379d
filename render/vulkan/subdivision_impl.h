// How drawn tiles become triangles: by the card's tessellation stages, or as a mesh that compute shaders
// make.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "render/tile_seams.h"
#include "render/vulkan/graphics_impl.h"
#include "render/vulkan/tile_store_impl.h"

namespace patchwork::vk {

/// Of a tile: 128 a block, and one more for each half cell that a finer neighbour adds to an edge.
inline constexpr std::uint32_t kMostTriangles = 64 * 128 + 4 * 64;

/// What both ways read, whose owner outlives them.
struct Subdivided {
  const Device::Impl& device;
  const TileStore& store;
  const Buffer& frame;     ///< terrain.glsl: FrameBlock
  const OwnedView& draws;  ///< the drawn tiles, group by group
  std::uint32_t most_tiles;
};

/// Drawn tiles one after the other that the same pipeline draws.
struct DrawGroup {
  std::uint32_t first, count;
  bool holes;             ///< some may have
  std::uint32_t effects;  ///< effects::Set
};
inline constexpr std::uint32_t kMostGroups = 32;

class Subdivision {
 public:
  virtual ~Subdivision() = default;

  /// Of the terrain's pipelines: the stages before fragments, and what these read at binding 3.
  virtual std::vector<GraphicsState::Stage> stages() const = 0;
  virtual VkPrimitiveTopology topology() const = 0;
  virtual const OwnedView& facts() const = 0;

  /// What is drawn from now on: groups that follow each other, kMostGroups at most; returns bytes sent.
  /// REQUIRES: nothing that uses it still runs.
  virtual std::size_t set(std::span<const DrawGroup> groups) = 0;
  /// Outside of a render pass, with tiles to draw: how each block is divided.
  virtual void record(VkCommandBuffer commands) const = 0;
  virtual std::size_t dispatches() const = 0;  ///< of record
  /// Inside of one, with the pipeline of a group: one indirect call.
  virtual void draw(VkCommandBuffer commands, std::size_t group) const = 0;
  virtual std::uint32_t draws() const = 0;  ///< of all calls

  /// Three vertices for each triangle that was recorded last, if it makes a mesh. Waits for the card.
  virtual std::vector<MeshVertex> read_mesh(Commands&) const { return {}; }
};

std::unique_ptr<Subdivision> make_tessellation(const Subdivided& what);
std::unique_ptr<Subdivision> make_mesh(const Subdivided& what);

}  // namespace patchwork::vk
