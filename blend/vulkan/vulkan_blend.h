// The blend on the graphics card: the surface and the bound of blend.h, for rasters, points and tiles.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "blend/blend.h"
#include "blend/vulkan/device.h"
#include "blend/vulkan/patch_pool.h"
#include "blend/vulkan/tile_binning.h"

namespace patchwork {

struct VulkanOptions {
  std::size_t memory = std::size_t{256} << 20;  ///< bytes: of the patch pool
  int tile = 64;                                ///< vertices along each side of the tiles of at_pixels
  bool classify = true;   ///< blocks leave out what does not reach them; the bits do not depend on it
  bool choose = true;     ///< tiles do; else every point walks through all patches
  bool gradient = false;  ///< for tiles: the slope too
};

/// Tiles [first, first + count) of a call, vertices row-major, tile after tile, `side` x `side` each whatever
/// they want. NaN, and source 0, where there is no data.
struct TileHeights {
  std::size_t first = 0, count = 0;
  int side = 0;
  double base = 0;                            ///< metres
  std::span<const float> height = {};         ///< metres above `base`
  std::span<const float> bound = {};          ///< metres
  std::span<const std::int32_t> source = {};  ///< as BlendOutput has it
  std::span<const float> gradient = {};       ///< dh/dx, dh/dy pairs
};

/// Pairs of a block of 8 x 8 vertices and a patch of its tile.
struct BlockShares {
  std::uint64_t out = 0, inside = 0, partial = 0;
};

/// Heights of rasters differ from Blend's by at most departure(), which their bounds count besides Blend's;
/// at points it computes in double, as Blend does. The bits depend on the data, the tile and the vertex
/// alone. Not safe for concurrent use.
class VulkanBlend : public Evaluator {
 public:
  /// REQUIRES: `db` outlives it and stays in one state. `patches` in the order of Extraction::patches. Throws
  /// Error: the device's memory, damaged payloads.
  VulkanBlend(std::shared_ptr<Device> device, const Database& db, std::span<const PatchId> patches,
              const BlendOptions& options, const VulkanOptions& more = {});
  ~VulkanBlend() override;

  /// Metres, for a height of so many.
  static double departure(double height) { return 1e-3 + 1e-6 * std::abs(height); }

  /// The next cut: what is resident still is not sent again.
  void change(std::span<const PatchId> patches);
  /// The database moved to another state: until change() there is no cut. Patches of grids that are in it
  /// still stay resident.
  void restart();

  /// As Blend's. REQUIRES: out.patch is empty.
  BlendCounts at_points(std::span<const double> x, std::span<const double> y,
                        const BlendOutput& out) const override;
  BlendCounts at_pixels(const RasterFrame& raster, int width, int row, int rows,
                        const BlendOutput& out) const override;

  /// Any tiles of a lattice in submissions of many; `take` is called for each in turn, while the next one
  /// runs. REQUIRES: no tile is larger than side x side.
  BlendCounts at_tiles(const RasterFrame& lattice, std::span<const Tile> tiles, int side,
                       const std::function<void(const TileHeights&)>& take) const;

  const Device& device() const;
  const PatchPool& pool() const;
  BlockShares shares() const;  ///< of all tiles so far
  /// Of all submissions so far, on the device, milliseconds.
  struct Times {
    double send = 0, classify = 0, blend = 0, exact = 0, read_back = 0;
  };
  Times times() const;
  std::uint64_t exact_points() const;  ///< points of tiles that were evaluated in double

  struct Impl;  ///< vulkan_blend_impl.h: results that stay on the card
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
