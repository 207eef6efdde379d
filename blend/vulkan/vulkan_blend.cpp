#include "blend/vulkan/vulkan_blend.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <numeric>
#include <utility>

#include "blend/vulkan/vulkan_blend_impl.h"

namespace patchwork {

namespace {

constexpr std::uint32_t kBlock = 8;  // common.glsl
// Of a submission: 4 to 20 MB of results, some 30 ms on lavapipe.
constexpr std::size_t kBatchPoints = std::size_t{1} << 20;
constexpr std::size_t kBatchTiles = 32768;  // a dispatch may have 65535 groups along an axis
constexpr std::uint64_t kListWords = std::uint64_t{1} << 24;

std::uint64_t list_words(std::span<const Candidates> chosen, std::uint64_t blocks) {
  std::uint64_t words = 0;
  for (const Candidates& c : chosen) words += blocks * (c.size() + 1);
  return words;
}

std::uint64_t wanted_points(std::span<const Tile> tiles) {
  std::uint64_t n = 0;
  for (const Tile& t : tiles) n += std::uint64_t(t.across) * std::uint64_t(t.down);
  return n;
}

}  // namespace

void add(BlendCounts& sum, const vk::TallyHead& t, std::uint64_t points) {
  sum += BlendCounts{points, t.contributions, t.most, double(std::bit_cast<float>(t.bound_max))};
}

namespace {

// A submission whose results are still to come.
struct Pending {
  vk::Frame* frame = nullptr;
  std::size_t first = 0, count = 0;
  std::uint64_t points = 0;
};

}  // namespace

// Shaders name a grid by its id, which outlives its place among the others. The base lies in the middle of
// all heights, where float32 has 0.25 mm at worst.
void VulkanBlend::Impl::remember_grids() {
  places.assign(1, 0), grids.clear();
  for (const Grid& g : db.grids()) {
    grids[g.info.id] = g.info.digest;
    const std::size_t id = g.info.id.value + 1;
    if (places.size() <= id) places.resize(id + 1, 0);
    places[id] = std::int32_t(&g - db.grids().data()) + 1;
  }
  base = db.heights().middle();
}

// A cut that the pool has room for becomes resident as a whole, a larger one part by part as submissions need
// it.
void VulkanBlend::Impl::hold(std::span<const PatchId> patches) {
  placed.clear(), ragged = false;
  std::size_t needed = 0;
  for (const PatchId id : patches) {
    placed.push_back(place(db, id, options.smoothness));
    needed += PatchPool::slots_of(db, id);
    ragged |= !is_plain(placed.back());
  }
  slots.assign(placed.size(), {});
  all_resident = needed <= pool->slots();
  if (!all_resident) return;
  pool->hold(patches);
  for (std::size_t k = 0; k < placed.size(); ++k) remember(std::uint32_t(k));
}

void VulkanBlend::Impl::remember(std::uint32_t k) {
  const PatchPool::Resident& r = pool->at(placed[k].id);
  slots[k] = {r.slot, r.origin, r.height};
  ragged |= r.steepest > kTooSteep[options.smoothness];
}

bool VulkanBlend::Impl::hold_chosen(std::span<const Candidates> chosen, bool may_fail) {
  if (all_resident) return true;
  std::vector<std::uint32_t> wanted;
  for (const Candidates& c : chosen) wanted.insert(wanted.end(), c.begin(), c.end());
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  std::vector<PatchId> patches;
  std::size_t needed = 0;
  for (const std::uint32_t k : wanted)
    patches.push_back(placed[k].id), needed += PatchPool::slots_of(db, placed[k].id);
  if (needed > pool->slots() && may_fail) return false;
  pool->hold(patches);
  for (const std::uint32_t k : wanted) remember(k);
  return true;
}

vk::Push VulkanBlend::Impl::push() const {
  vk::Push p{};
  p.base = base;
  p.strict_error = options.strict ? float(options.error) : std::numeric_limits<float>::infinity();
  p.classify = more.classify;
  return p;
}

std::vector<Candidates> VulkanBlend::Impl::choose(const RasterFrame& lattice,
                                                  std::span<const Tile> tiles) const {
  if (more.choose) return choose_patches(placed, lattice, tiles, priority() && more.classify);
  Candidates all(placed.size());
  std::iota(all.begin(), all.end(), 0u);
  return std::vector<Candidates>(tiles.size(), all);
}

// Planes of the results lie one after another: heights, then what else is wanted.
vk::Work VulkanBlend::Impl::tile_work(const RasterFrame& f, const TileBins& bins, int side,
                                      vk::Planes planes) const {
  vk::Work work{.bins = &bins, .push = push(), .planes = planes, .ragged = ragged};
  vk::Push& p = work.push;
  p.x0 = f.x0, p.xc = f.xc, p.xr = f.xr, p.y0 = f.y0, p.yc = f.yc, p.yr = f.yr;
  p.tiles = std::uint32_t(bins.tiles.size()), p.side = std::uint32_t(side),
  p.blocks = (p.side + kBlock - 1) / kBlock;
  const std::uint32_t plane = std::uint32_t(bins.tiles.size()) * p.side * p.side;
  std::uint32_t words = plane;
  if (planes.bound) p.bound_at = words, words += plane;
  if (planes.source) p.source_at = words, words += plane;
  if (planes.gradient) p.gradient_at = words, words += 2 * plane;
  work.result_words = words;
  return work;
}

void VulkanBlend::Impl::note(const vk::Frame& frame) {
  const vk::TallyHead& t = frame.tally();
  shares.out += t.outs, shares.inside += t.insides, shares.partial += t.partials;
  exact_points += t.later_count;
  const std::vector<double> ms = frame.times();
  times.send += ms[0], times.classify += ms[1], times.blend += ms[2], times.exact += ms[3];
  times.read_back += ms[4];
}

TileHeights VulkanBlend::Impl::heights_of(const vk::Frame& frame, int side, vk::Planes planes) {
  const auto words = frame.results();
  const std::size_t plane = words.size() / planes.words();
  const auto floats = [&](std::size_t at, std::size_t n) {
    return std::span(reinterpret_cast<const float*>(words.data()) + at, n);
  };
  std::size_t at = plane;
  TileHeights out{.side = side, .base = base, .height = floats(0, plane)};
  if (planes.bound) out.bound = floats(at, plane), at += plane;
  if (planes.source) {
    sources.resize(plane);
    std::transform(words.begin() + long(at), words.begin() + long(at + plane), sources.begin(),
                   [&](std::uint32_t bits) { return source_of(bits); });
    out.source = sources, at += plane;
  }
  if (planes.gradient) out.gradient = floats(at, 2 * plane);
  return out;
}

// Two frames: while one runs on the device, the results of the other are taken and the next is prepared.
BlendCounts VulkanBlend::Impl::run(const RasterFrame& lattice, std::span<const Tile> tiles, int side,
                                   const Make& make, const Take& take) {
  BlendCounts counts;
  Pending before;
  const auto collect = [&](const Pending& p) {
    if (!p.frame) return;
    p.frame->finish();
    note(*p.frame);
    add(counts, p.frame->tally(), p.points);
    take(*p.frame, p.first, p.count);
  };
  const std::size_t a_tile = std::size_t(side) * std::size_t(side);
  const std::uint32_t blocks = (std::uint32_t(side) + kBlock - 1) / kBlock;
  std::size_t count = std::clamp<std::size_t>(kBatchPoints / a_tile, 1, kBatchTiles), turn = 0;
  for (std::size_t first = 0; first < tiles.size();) {
    const std::size_t n = std::min(count, tiles.size() - first);
    const auto some = tiles.subspan(first, n);
    const std::vector<Candidates> chosen = choose(lattice, some);
    // Too much for the lists or for the pool: half of the tiles will do with less of both.
    if (n > 1 && (list_words(chosen, blocks * blocks) > kListWords || !hold_chosen(chosen, true))) {
      count = n / 2;
      continue;
    }
    if (n == 1) hold_chosen(chosen, false);
    const TileBins bins = bin_tiles(placed, slots, lattice, some, chosen, blocks * blocks, base);
    const Pending now{frames[turn ^= 1].get(), first, n, wanted_points(some)};
    now.frame->submit(make(bins));
    collect(before);
    before = now, first += n;
  }
  collect(before);
  return counts;
}

BlendCounts VulkanBlend::Impl::run_tiles(const RasterFrame& lattice, std::span<const Tile> tiles, int side,
                                         vk::Planes planes,
                                         const std::function<void(const TileHeights&)>& take) {
  return run(
      lattice, tiles, side, [&](const TileBins& bins) { return tile_work(lattice, bins, side, planes); },
      [&](const vk::Frame& frame, std::size_t first, std::size_t count) {
        TileHeights heights = heights_of(frame, side, planes);
        heights.first = first, heights.count = count;
        take(heights);
      });
}

VulkanBlend::VulkanBlend(std::shared_ptr<Device> device, const Database& db, std::span<const PatchId> patches,
                         const BlendOptions& options, const VulkanOptions& more)
    : impl_(std::make_unique<Impl>(std::move(device), db, options, more)) {
  assert(options.smoothness >= 0 && options.smoothness <= 2 && more.tile > 0);
  impl_->remember_grids();
  Device::Impl& d = impl_->device->impl();
  const std::size_t room = std::min(more.memory / PatchPool::kSlotBytes, impl_->device->most_patches());
  impl_->pool = std::make_unique<PatchPool>(impl_->device, db, room);
  impl_->passes = d.passes[{options.smoothness, impl_->priority()}];
  if (!impl_->passes)
    impl_->passes = d.passes[{options.smoothness, impl_->priority()}] =
        std::make_shared<vk::Passes>(d, options.smoothness, impl_->priority());
  for (auto& frame : impl_->frames)
    frame = std::make_unique<vk::Frame>(d, *impl_->passes, impl_->pool->impl());
  impl_->hold(patches);
}

VulkanBlend::~VulkanBlend() = default;

void VulkanBlend::change(std::span<const PatchId> patches) { impl_->hold(patches); }
// Ids are given to other grids again; patches of the same grid have the same samples, rectangles and errors.
void VulkanBlend::restart() {
  const std::map<GridId, Digest> before = std::exchange(impl_->grids, {});
  impl_->remember_grids();
  impl_->pool->drop([&](GridId id) {
    const auto now = impl_->grids.find(id);
    return now == impl_->grids.end() || now->second != before.at(id);
  });
  impl_->hold({});
}
const Device& VulkanBlend::device() const { return *impl_->device; }
const PatchPool& VulkanBlend::pool() const { return *impl_->pool; }
BlockShares VulkanBlend::shares() const { return impl_->shares; }
VulkanBlend::Times VulkanBlend::times() const { return impl_->times; }
std::uint64_t VulkanBlend::exact_points() const { return impl_->exact_points; }

BlendCounts VulkanBlend::at_tiles(const RasterFrame& lattice, std::span<const Tile> tiles, int side,
                                  const std::function<void(const TileHeights&)>& take) const {
  return impl_->run_tiles(lattice, tiles, side, {.gradient = impl_->more.gradient}, take);
}

}  // namespace patchwork
