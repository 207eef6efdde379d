#include "blend/vulkan/patch_pool.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <unordered_set>

#include "blend/vulkan/patch_pool_impl.h"
#include "db/error.h"

namespace patchwork {

namespace {

constexpr std::size_t kSamples = PatchSurface::kSide * PatchSurface::kSide;
constexpr VkDeviceSize kRingBytes = VkDeviceSize{8} << 20;

template <class T>
void put(T (&to)[4], const LatticeRect& r) {
  to[0] = T(r.i0), to[1] = T(r.j0), to[2] = T(r.i1), to[3] = T(r.j1);
}

// The largest difference between neighbouring samples that a point of the domain reads, metres.
double steepest(const PatchSurface& s, const Blend::Placed& p) {
  constexpr int side = PatchSurface::kSide;
  const auto low = [](double at) { return std::max(0, int(at) - 1); };
  const auto high = [](double at) { return std::min(side - 1, int(at) + 2); };
  const auto code = [&](int i, int j) { return s.codes[std::size_t(j * side + i)]; };
  const int i0 = low(p.domain.i0), i1 = high(p.domain.i1), j0 = low(p.domain.j0), j1 = high(p.domain.j1);
  float most = 0;
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i) {
      if (i > i0) most = std::max(most, std::abs(code(i, j) - code(i - 1, j)));
      if (j > j0) most = std::max(most, std::abs(code(i, j) - code(i, j - 1)));
    }
  return double(most) * std::abs(p.quantum);
}

PatchRecord32 record32(const Blend::Placed& p, const PatchPool::Resident& r) {
  PatchRecord32 out{};
  put(out.kernel, p.kernel), put(out.ramp, p.ramp), put(out.domain, p.domain), put(out.samples, p.samples);
  out.slope[0] = float(1 / (p.kernel.i0 - p.ramp.i0)), out.slope[1] = float(1 / (p.kernel.j0 - p.ramp.j0));
  out.slope[2] = float(1 / (p.ramp.i1 - p.kernel.i1)), out.slope[3] = float(1 / (p.ramp.j1 - p.kernel.j1));
  out.volume = float(p.volume), out.rim = float(p.rim), out.holes = r.holes ? float(*r.holes) : -1;
  int kind = (!p.ragged && p.kernel_is_sampled() ? kSolid : 0) | (is_plain(p) ? kPlain : 0);
  for (int k = 0; k < 3; ++k) kind |= r.steepest > kTooSteep[k] ? kSteep << k : 0;
  out.kind = float(kind);
  out.turn[0] = float(p.ua), out.turn[1] = float(p.ub), out.turn[2] = float(p.va), out.turn[3] = float(p.vb);
  return out;
}

// The CPU's own numbers, so that exact.comp rounds as it does.
PatchRecord64 record64(const Blend::Placed& p, const PatchRecord& facts) {
  PatchRecord64 out{};
  out.x0 = p.x0, out.y0 = p.y0, out.ua = p.ua, out.ub = p.ub, out.va = p.va, out.vb = p.vb;
  out.first_i = p.first_i, out.first_j = p.first_j;
  put(out.kernel, p.kernel), put(out.ramp, p.ramp), put(out.domain, p.domain), put(out.samples, p.samples);
  out.quantum = p.quantum, out.base = p.base, out.origin = p.origin, out.volume = p.volume, out.rim = p.rim;
  std::copy(facts.error.begin(), facts.error.end(), out.error);
  return out;
}

// holes.glsl says what a word holds.
std::vector<std::uint32_t> words_of(const PatchSurface::Holes& h) {
  std::vector<std::uint32_t> words(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k)
    words[k] = std::uint32_t(h.answering[k] != 0) | std::uint32_t(h.real[k] != 0) << 1 |
               std::uint32_t{h.near[k]} << 8 | std::uint32_t{h.wide[k]} << 16;
  return words;
}

// Samples are seen as codes and, in the slots of holes, as words: two views of one buffer.
std::unique_ptr<PatchPool::Impl> make_impl(std::shared_ptr<Device> device, std::size_t slots) {
  const Device::Impl& d = device->impl();
  const auto buffer = [&](std::size_t bytes, VkBufferUsageFlags usage) {
    return vk::Buffer(d, slots * bytes, usage, vk::Where::card);
  };
  vk::Buffer samples = buffer(4 * kSamples, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT);
  vk::Buffer records = buffer(sizeof(PatchRecord32), VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT);
  vk::Buffer exact = buffer(sizeof(PatchRecord64), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  vk::OwnedView sample_texels = vk::texels(d, samples, VK_FORMAT_R32_SFLOAT);
  vk::OwnedView word_texels = vk::texels(d, samples, VK_FORMAT_R32_UINT);
  vk::OwnedView record_texels = vk::texels(d, records, VK_FORMAT_R32G32B32A32_SFLOAT);
  return std::unique_ptr<PatchPool::Impl>(new PatchPool::Impl{
      std::move(device), std::move(samples), std::move(records), std::move(exact), std::move(sample_texels),
      std::move(word_texels), std::move(record_texels), vk::UploadRing(d, kRingBytes)});
}

}  // namespace

bool is_plain(const Blend::Placed& p) {
  return !p.ragged && p.samples.i0 <= p.domain.i0 && p.samples.j0 <= p.domain.j0 &&
         p.samples.i1 >= p.domain.i1 && p.samples.j1 >= p.domain.j1;
}

PatchPool::PatchPool(std::shared_ptr<Device> device, const Database& db, std::size_t slots)
    : db_(db), slots_(std::max<std::size_t>(slots, 2)) {
  if (slots_ > device->most_patches())
    throw Error(device->name(),
                "a pool of " + std::to_string(slots_) + " patches is more than it can address",
                "ask for a smaller extent or a larger error");
  impl_ = make_impl(std::move(device), slots_);
  for (std::size_t s = slots_; s-- > 0;) free_.push_back(std::uint32_t(s));
}

PatchPool::~PatchPool() = default;

std::size_t PatchPool::bytes_of(const Resident& r) {
  return (r.holes ? 2 : 1) * 4 * kSamples + sizeof(PatchRecord32) + sizeof(PatchRecord64);
}

void PatchPool::hold(std::span<const PatchId> patches) {
  ++holds_, unused_known_ = false;
  std::vector<PatchId> missing;
  for (const PatchId id : patches) {
    const auto at = residents_.find(id);
    if (at == residents_.end())
      missing.push_back(id);
    else
      at->second.held = holds_;
  }
  std::sort(missing.begin(), missing.end());  // by place: neighbours are cut from the same chunks
  for (const PatchId id : missing) add(id);
  impl_->ring.flush();
}

void PatchPool::drop(const std::function<bool(GridId)>& gone) {
  std::erase_if(residents_, [&](const auto& resident) {
    if (!gone(resident.first.grid())) return false;
    release(resident.second);
    return true;
  });
}

// Slots of what goes are free at once: uploads into them are queued behind whatever still reads them.
void PatchPool::release(const Resident& r) {
  free_.push_back(r.slot);
  if (r.holes) free_.push_back(*r.holes);
  ++traffic_.dropped;
}

void PatchPool::require(std::size_t slots) {
  if (free_.size() < slots && !unused_known_) {
    unused_.clear(), unused_known_ = true;
    for (const auto& [id, r] : residents_)
      if (r.held != holds_) unused_.push_back(id);
    std::sort(unused_.begin(), unused_.end(),
              [&](PatchId a, PatchId b) { return residents_.at(a).held > residents_.at(b).held; });
  }
  for (; free_.size() < slots && !unused_.empty(); unused_.pop_back()) {
    const auto at = residents_.find(unused_.back());
    release(at->second), residents_.erase(at);
  }
  if (free_.size() < slots)
    throw Error(impl_->device->name(), "the patches do not fit into its pool of " + std::to_string(slots_),
                "ask for a smaller extent or a larger error, or give it more memory");
}

std::uint32_t PatchPool::take_slot() {
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  return slot;
}

void PatchPool::add(PatchId id) {
  const std::shared_ptr<const PatchSurface> surface = db_.surface(id);
  require(surface->holes ? 2 : 1);
  const Blend::Placed placed = place(db_, id, 0);
  const PatchRecord facts = db_.patch(id);
  const float origin = surface->codes[kSamples / 2];
  Resident r{.slot = take_slot(),
             .origin = origin,
             .height = placed.quantum * (placed.origin + double(origin)) + placed.base,
             .held = holds_};
  const auto send = [&](const vk::Buffer& to, std::uint32_t slot, const auto& items) {
    const auto bytes = std::as_bytes(std::span(items));
    impl_->ring.write(to, VkDeviceSize{slot} * bytes.size(), bytes);
  };
  send(impl_->samples, r.slot, surface->codes);
  r.steepest = steepest(*surface, placed);
  if (surface->holes) {
    r.holes = take_slot();
    send(impl_->samples, *r.holes, words_of(*surface->holes));
  }
  const PatchRecord32 record[] = {record32(placed, r)};
  const PatchRecord64 exact[] = {record64(placed, facts)};
  send(impl_->records, r.slot, record);
  send(impl_->exact, r.slot, exact);
  residents_.emplace(id, r);
  ++traffic_.sent, traffic_.bytes += bytes_of(r);
}

}  // namespace patchwork
