// What the files of VulkanBlend share.
#pragma once

#include <cstdlib>
#include <map>

#include "blend/vulkan/frame_impl.h"
#include "blend/vulkan/vulkan_blend.h"

namespace patchwork {

struct VulkanBlend::Impl {
  std::shared_ptr<Device> device;
  const Database& db;
  BlendOptions options;
  VulkanOptions more;
  std::vector<Blend::Placed> placed;
  std::vector<SlotOf> slots;  // of `placed`, of those that are resident
  bool ragged = false;        // some patch is not plain, or too steep
  bool all_resident = true;   // else each submission makes its own patches so
  std::unique_ptr<PatchPool> pool;
  std::shared_ptr<vk::Passes> passes;
  std::unique_ptr<vk::Frame> frames[2];
  std::vector<std::int32_t> places;   // of a grid's id + 1: 1 + its place in Database::grids()
  std::map<GridId, Digest> grids;     // of the state that resident patches come from
  std::vector<std::int32_t> sources;  // of the submission that is being taken
  double base = 0;                    // metres: heights on the card are relative to it
  BlockShares shares;
  Times times;
  std::uint64_t exact_points = 0;

  Impl(std::shared_ptr<Device> d, const Database& database, const BlendOptions& o, const VulkanOptions& m)
      : device(std::move(d)), db(database), options(o), more(m) {}
  bool priority() const { return options.composition == Composition::priority; }
  void remember_grids();
  void hold(std::span<const PatchId> patches);
  void remember(std::uint32_t k);  ///< where the pool has patch k
  /// Makes the chosen patches resident; false if they do not fit and may be halved.
  bool hold_chosen(std::span<const Candidates> chosen, bool may_fail);
  vk::Push push() const;
  vk::Work tile_work(const RasterFrame& lattice, const TileBins& bins, int side, vk::Planes planes) const;
  std::vector<Candidates> choose(const RasterFrame& lattice, std::span<const Tile> tiles) const;
  void note(const vk::Frame& frame);
  std::int32_t source_of(std::uint32_t bits) const {
    const auto s = std::int32_t(bits);
    const auto id = std::size_t(std::abs(s));
    return id >= places.size() ? 0 : s < 0 ? -places[id] : places[id];
  }
  BlendCounts run_tiles(const RasterFrame& lattice, std::span<const Tile> tiles, int side, vk::Planes planes,
                        const std::function<void(const TileHeights&)>& take);
  /// Any work on tiles: `make` says what is submitted, `take` has the results, or with Work::read_from at
  /// their end finds them on the card.
  using Make = std::function<vk::Work(const TileBins& bins)>;
  using Take = std::function<void(const vk::Frame& frame, std::size_t first, std::size_t count)>;
  BlendCounts run(const RasterFrame& lattice, std::span<const Tile> tiles, int side, const Make& make,
                  const Take& take);
  TileHeights heights_of(const vk::Frame& frame, int side, vk::Planes planes);
};

/// What a submission counted joins the sum.
void add(BlendCounts& sum, const vk::TallyHead& tally, std::uint64_t points);

}  // namespace patchwork
