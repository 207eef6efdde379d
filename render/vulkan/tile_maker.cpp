#include "render/vulkan/tile_maker.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "blend/vulkan/vulkan_blend_impl.h"
#include "db/stopwatch.h"
#include "query/extract.h"
#include "render/tile_cut.h"
#include "render/tile_patches.h"
#include "render/vulkan/shaders.h"
#include "render/vulkan/tile_store_impl.h"

namespace patchwork {

namespace {

constexpr int kSide = TileLattice::kSamples + 2;  // with the halo
constexpr std::uint32_t kMost = 64;               // tiles of a submission
constexpr std::uint32_t kBlocks = 64;             // of a tile
constexpr std::uint32_t kSummary = 5;             // floats of a block: tile_finish.glsl
constexpr VkDescriptorType kTypes[] = {
    VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,       VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,       VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_IMAGE,        VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER};

struct FinishPush {
  std::uint32_t bound_at, slope_at;
  float shift, between;
  std::uint32_t source_at;
};

Tile sampled_tile(const TileLattice& lattice, const TileKey& key) {
  const int stride = 1 << key.level;
  return {lattice.first_x(key) - stride, lattice.first_y(key) - stride, stride, kSide, kSide};
}

}  // namespace

struct TileMaker::Impl {
  std::shared_ptr<Device> device;
  const Database& db;
  const TileLattice& lattice;
  vk::TileStore& store;
  double base;
  BlendOptions options;
  std::size_t memory;
  bool published;
  std::unique_ptr<VulkanBlend> blend;
  vk::Bindings bindings;
  vk::OwnedPipeline finish;
  VkDescriptorSet set = VK_NULL_HANDLE;
  vk::OwnedSets sets;
  vk::Buffer summaries, slots, lacks;
  vk::Commands commands;
  TileMakerCounts counts;

  Impl(std::shared_ptr<Device> d, const Database& database, const TileLattice& l, vk::TileStore& s, double b,
       const BlendOptions& k, std::size_t m, bool as_published)
      : device(std::move(d)),
        db(database),
        lattice(l),
        store(s),
        base(b),
        options(k),
        memory(m),
        published(as_published),
        bindings(device->impl(), kTypes, sizeof(FinishPush)),
        finish(make_finish()),
        sets(bindings.make_set(set)),
        summaries(device->impl(), kMost * kBlocks * kSummary * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                  vk::Where::readback),
        slots(device->impl(), kMost * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, vk::Where::upload),
        lacks(device->impl(), kMost * kBlocks * sizeof(TilePatches::Block),
              VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, vk::Where::upload),
        commands(device->impl()) {
    bindings.bind(set, 1, store.heights), bindings.bind(set, 2, store.blocks);
    bindings.bind(set, 3, VK_NULL_HANDLE, store.slopes.view(), VK_IMAGE_LAYOUT_GENERAL);
    const vk::Texture& knowledge = store.knowledge ? *store.knowledge : store.slopes;
    bindings.bind(set, 6, VK_NULL_HANDLE, knowledge.view(), VK_IMAGE_LAYOUT_GENERAL);
    bindings.bind(set, 4, summaries), bindings.bind(set, 5, slots), bindings.bind(set, 8, lacks);
  }

  vk::OwnedPipeline make_finish() const {
    const std::uint32_t constants[] = {store.holds.knowledge, published};
    return vk::make_pipeline(bindings, store.holds.meshes ? shaders::mesh_finish() : shaders::tile_finish(),
                             constants);
  }
  vk::Planes planes() const { return {.bound = true, .source = store.holds.knowledge, .gradient = true}; }

  void use(const std::vector<PatchId>& patches) {
    const std::uint64_t before = blend ? blend->pool().traffic().bytes : 0;
    const std::uint64_t sent = blend ? blend->pool().traffic().sent : 0;
    if (blend)
      blend->change(patches);
    else
      blend = std::make_unique<VulkanBlend>(device, db, patches, options, VulkanOptions{.memory = memory});
    counts.bytes += blend->pool().traffic().bytes - before;
    counts.patches += blend->pool().traffic().sent - sent;
  }

  // The submission's results go to the slots of its tiles, and each tile's summary to the host.
  void run_finish(const vk::Frame& frame, std::span<const std::uint32_t> to,
                  std::span<const TilePatches> patches) {
    const vk::OwnedView results = vk::texels(device->impl(), frame.results_on_card(), VK_FORMAT_R32_SFLOAT);
    const vk::OwnedView words = vk::texels(device->impl(), frame.results_on_card(), VK_FORMAT_R32_SINT);
    bindings.bind(set, 0, results), bindings.bind(set, 7, words);
    std::copy(to.begin(), to.end(), reinterpret_cast<std::uint32_t*>(slots.mapped()));
    auto* lack = reinterpret_cast<TilePatches::Block*>(lacks.mapped());
    for (const TilePatches& p : patches) lack = std::copy(p.blocks.begin(), p.blocks.end(), lack);
    const auto plane = std::uint32_t(to.size() * kSide * kSide);  // heights, bounds, perhaps sources, slopes
    const FinishPush p{plane, (2 + planes().source) * plane, float(blend->impl().base - base),
                       options.smoothness == 0 ? 0.5f : 0.25f, 2 * plane};
    const VkCommandBuffer c = commands.begin();
    vk::barrier(c);
    vkCmdBindPipeline(c, VK_PIPELINE_BIND_POINT_COMPUTE, finish.get());
    vkCmdBindDescriptorSets(c, VK_PIPELINE_BIND_POINT_COMPUTE, bindings.layout(), 0, 1, &set, 0, nullptr);
    vkCmdPushConstants(c, bindings.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof p, &p);
    vkCmdDispatch(c, std::uint32_t(to.size()), 1, 1);
    vk::barrier(c);
    commands.submit(), commands.wait();
  }

  // From what was measured of its blocks.
  TileFacts summary(std::size_t k, const TileKey& key, const TilePatches& patches) const {
    constexpr int kSide = TilePatches::kBlocks, kShare = kSide / TileFacts::kParts;
    const float* s = reinterpret_cast<const float*>(summaries.mapped()) + k * kBlocks * kSummary;
    const double shift = blend->impl().base;
    TileFacts f;
    f.patches = patches.patches;
    HeightRange all;
    for (int b = 0; b < int(kBlocks); ++b, s += kSummary) {
      const bool reached = patches.blocks[std::size_t(b)].reached(), holes = s[4] > 0;
      f.holes |= holes || !reached;
      if (!reached) continue;
      HeightRange heights{double(s[0]) + shift, double(s[1]) + shift};
      // All of its data may lie between its samples.
      if (!(heights.lowest <= heights.highest)) heights = patches.heights;
      TileFacts::Part& part = f.part(b % kSide / kShare, b / kSide / kShare);
      // A hole's outline is drawn to a cell.
      part.error = std::max({part.error, double(s[2]), holes ? 1.5 * lattice.step(key.level) : 0});
      part.heights.add(heights), all.add(heights);
      f.error = std::max(f.error, part.error), f.bound = std::max(f.bound, double(s[3]));
    }
    f.lowest = all.lowest, f.highest = all.highest;
    return f;
  }

  std::vector<Made> make(std::span<const TileKey> tiles, const TakeSlot& take_slot);
  void blend_tiles(std::span<const TileKey> tiles, std::span<const std::uint32_t> to,
                   std::span<const TilePatches> patches, std::vector<Made>& made);
};

void TileMaker::Impl::blend_tiles(std::span<const TileKey> tiles, std::span<const std::uint32_t> to,
                                  std::span<const TilePatches> patches, std::vector<Made>& made) {
  std::vector<Tile> sampled;
  for (const TileKey& k : tiles) sampled.push_back(sampled_tile(lattice, k));
  VulkanBlend::Impl& b = blend->impl();
  const RasterFrame frame = lattice.frame();
  const Stopwatch blending;
  const BlockShares before = blend->shares();
  double finishing = 0;
  const BlendCounts now = b.run(
      frame, sampled, kSide,
      [&](const TileBins& bins) {
        vk::Work work = b.tile_work(frame, bins, kSide, planes());
        work.read_from = work.result_words;
        return work;
      },
      [&](const vk::Frame& submission, std::size_t first, std::size_t n) {
        const Stopwatch watch;
        run_finish(submission, to.subspan(first, n), patches.subspan(first, n));
        ++counts.dispatches;
        for (std::size_t k = 0; k < n; ++k) {
          const TileKey& key = tiles[first + k];
          made.push_back({key, summary(k, key, patches[first + k]), to[first + k]});
        }
        finishing += watch.milliseconds();
      });
  const BlockShares after = blend->shares();
  counts.blocks.out += after.out - before.out, counts.blocks.inside += after.inside - before.inside;
  counts.blocks.partial += after.partial - before.partial;
  counts.blended += now;
  counts.blend_ms += blending.milliseconds() - finishing, counts.finish_ms += finishing;
}

std::vector<TileMaker::Made> TileMaker::Impl::make(std::span<const TileKey> tiles,
                                                   const TakeSlot& take_slot) {
  std::vector<Made> made;
  if (tiles.empty()) return made;
  const int level = tiles.front().level;
  const Stopwatch extracting;
  std::vector<Extent> places;
  for (const TileKey& k : tiles) places.push_back(with_halo(lattice, k));
  const Extraction x = extract(db, TileCut(lattice.error(level), places));
  counts.extract_ms += extracting.milliseconds();
  if (x.patches.empty()) {
    for (const TileKey& k : tiles) made.push_back({k, {}, TileCache::kNoSlot});
    return made;
  }
  const Stopwatch sending;
  use(x.patches);
  counts.send_ms += sending.milliseconds();
  std::vector<PatchId> sorted = x.patches;
  std::sort(sorted.begin(), sorted.end());
  std::vector<TileKey> filled;
  std::vector<std::uint32_t> to;
  std::vector<TilePatches> patches;
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    assert(tiles[k].level == level);
    const TilePatches p = TilePatches::of(db, blend->impl().placed, sorted, lattice, tiles[k]);
    if (!p.reached()) {
      made.push_back({tiles[k], {}, TileCache::kNoSlot});
      continue;
    }
    const std::uint32_t slot = take_slot(tiles[k]);
    if (slot == TileCache::kNoSlot) break;
    filled.push_back(tiles[k]), to.push_back(slot), patches.push_back(p);
  }
  for (std::size_t from = 0; from < filled.size(); from += kMost) {
    const std::size_t n = std::min<std::size_t>(kMost, filled.size() - from);
    blend_tiles(std::span(filled).subspan(from, n), std::span(to).subspan(from, n),
                std::span(patches).subspan(from, n), made);
  }
  counts.tiles += filled.size();
  return made;
}

TileMaker::TileMaker(std::shared_ptr<Device> device, const Database& db, const TileLattice& lattice,
                     vk::TileStore& store, double base, const BlendOptions& blend, std::size_t memory,
                     bool published)
    : impl_(std::make_unique<Impl>(std::move(device), db, lattice, store, base, blend, memory, published)) {}
TileMaker::~TileMaker() = default;

std::vector<TileMaker::Made> TileMaker::make(std::span<const TileKey> tiles, const TakeSlot& take_slot) {
  return impl_->make(tiles, take_slot);
}

void TileMaker::prefetch(const Database& db, const TileLattice& lattice, const TileKey& tile) {
  const Extent place = with_halo(lattice, tile);
  std::vector<PatchId> patches = extract(db, TileCut(lattice.error(tile.level), {place})).patches;
  for (const PatchId id : patches) db.surface(id);
  // Making it asks for more records and pages than those.
  std::sort(patches.begin(), patches.end());
  TilePatches::prefetch(db, patches, lattice, tile);
}

void TileMaker::restart() {
  if (impl_->blend) impl_->blend->restart();
}
const TileMakerCounts& TileMaker::counts() const { return impl_->counts; }

}  // namespace patchwork
