// Patches resident on the card: what a cut needs is sent once and stays where it is while there is room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "blend/vulkan/device.h"
#include "db/database.h"

namespace patchwork {

/// A slot holds the samples of a patch; its holes, where it has any, take another one. Not safe for
/// concurrent use.
class PatchPool {
 public:
  /// What a slot takes on the card: samples and the two records.
  static constexpr std::size_t kSlotBytes = PatchSurface::kSide * PatchSurface::kSide * 4 + 7 * 16 + 32 * 8;

  struct Resident {
    std::uint32_t slot = 0;
    std::optional<std::uint32_t> holes = {};  ///< slot
    double steepest = 0;                      ///< metres: the largest difference between neighbouring samples
    float origin = 0;                         ///< a code of its middle: the shader's codes are relative to it
    double height = 0;                        ///< of that code, metres
    std::uint64_t held = 0;                   ///< the last call of hold() that named it
  };
  /// Since the pool was made.
  struct Traffic {
    std::uint64_t sent = 0, dropped = 0;  ///< patches
    std::uint64_t bytes = 0;              ///< sent
    bool operator==(const Traffic&) const = default;
  };

  /// REQUIRES: `db` outlives it. Throws Error: the card has no memory for so many slots.
  PatchPool(std::shared_ptr<Device> device, const Database& db, std::size_t slots);
  ~PatchPool();

  /// Sends those of `patches` that are not there; where room is lacking, others go, the longest unused first.
  /// Throws Error: they do not fit (those that did are resident), damaged payloads. CAVEAT: ids name patches
  /// of one state of the database; drop() what is gone after it moved to another one.
  void hold(std::span<const PatchId> patches);
  /// Patches of these grids are resident no more.
  void drop(const std::function<bool(GridId)>& gone);

  const Resident& at(PatchId id) const { return residents_.at(id); }
  const std::map<PatchId, Resident>& residents() const { return residents_; }
  const Traffic& traffic() const { return traffic_; }
  std::size_t slots() const { return slots_; }
  /// Slots that a patch may need, before its heights are read.
  static std::size_t slots_of(const Database& db, PatchId id) { return db.patch(id).ragged() ? 2 : 1; }
  /// Bytes that a patch is sent with.
  static std::size_t bytes_of(const Resident& r);

  struct Impl;  ///< patch_pool_impl.h
  const Impl& impl() const { return *impl_; }

 private:
  void add(PatchId id);
  void release(const Resident& resident);
  void require(std::size_t slots);
  std::uint32_t take_slot();

  const Database& db_;
  std::size_t slots_;
  std::unique_ptr<Impl> impl_;
  std::map<PatchId, Resident> residents_;
  std::vector<std::uint32_t> free_;
  std::vector<PatchId> unused_;  // by the running hold(), the longest last; listed when room is lacking
  bool unused_known_ = false;
  std::uint64_t holds_ = 0;
  Traffic traffic_;
};

}  // namespace patchwork
