// How drawn tiles become triangles: by the card's tessellation stages, or as a mesh that compute shaders
// make.
#pragma once

#include <cstdint>
#include <memory>
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
  const OwnedView& draws;  ///< the drawn tiles: those without holes, then those with some
  std::uint32_t most_tiles;
};

class Subdivision {
 public:
  virtual ~Subdivision() = default;

  /// Of the terrain's pipelines: the stages before fragments, and what these read at binding 3.
  virtual std::vector<GraphicsState::Stage> stages() const = 0;
  virtual VkPrimitiveTopology topology() const = 0;
  virtual const OwnedView& facts() const = 0;

  /// How many tiles are drawn from now on; returns bytes sent. REQUIRES: nothing that uses it still runs.
  virtual std::size_t set(std::uint32_t solid, std::uint32_t holed) = 0;
  /// Outside of a render pass, with tiles to draw: how each block is divided.
  virtual void record(VkCommandBuffer commands) const = 0;
  virtual std::size_t dispatches() const = 0;  ///< of record
  /// Inside of one, with the pipeline for tiles with or without holes: one indirect call.
  virtual void draw(VkCommandBuffer commands, bool holes) const = 0;
  virtual std::uint32_t draws() const = 0;  ///< of both calls

  /// Three vertices for each triangle that was recorded last, if it makes a mesh. Waits for the card.
  virtual std::vector<MeshVertex> read_mesh(Commands&) const { return {}; }
};

std::unique_ptr<Subdivision> make_tessellation(const Subdivided& what);
std::unique_ptr<Subdivision> make_mesh(const Subdivided& what);

}  // namespace patchwork::vk
