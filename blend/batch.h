// A batch of neighbouring points on its way through the patches that may reach it (used by blend.cpp).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "blend/placed.h"

namespace patchwork {

/// Scratch and accumulators of one batch; reused by a thread for one list of patches.
class Batch {
 public:
  static constexpr int kPoints = 1024;
  Batch();

  /// Where the points of the batch lie; at most kPoints. Overwritten by compose().
  std::vector<double> x, y;

  /// Composes `candidates` (places in `placed`, in order of priority) at the points.
  /// `inside`: with priority, the first candidate's kernel is known to contain all points, and it has no
  /// holes. `named`: source and patch are wanted too.
  void compose(const Database& db, const std::vector<Blend::Placed>& placed,
               const std::vector<std::uint32_t>& candidates, bool inside, bool named,
               const BlendOptions& options);

  std::vector<double> height, bound;
  std::vector<std::int32_t> source, patch;
  BlendCounts counts;

 private:
  // Points that the current patch reaches, in window coordinates.
  struct Reached {
    std::vector<double> u, v, weight, value;
    std::vector<double> floor;      // the weight without holes and rims
    std::vector<std::uint32_t> at;  // which points these are
    std::size_t n = 0;
  };

  const PatchSurface& surface(const Database& db, const Blend::Placed& p, std::uint32_t place);
  void compose_inside(const Blend::Placed& p, std::uint32_t place, const PatchSurface& s, int smoothness);
  void weigh(const Blend::Placed& p, const BlendOptions& options);
  void split();
  void take_all();
  void drop_settled();
  void keep_floors(const Blend::Placed& p, const BlendOptions& options);
  void fade_at_holes(const PatchSurface::Holes& holes, int smoothness);
  void read(const Blend::Placed& p, const PatchSurface& s, int smoothness, Reached& reached);
  void settle(const Blend::Placed& p, std::uint32_t place);
  void add(const Blend::Placed& p, std::uint32_t place, const PatchSurface& s, bool priority);
  void start();
  void finish();
  void withhold(double error);
  void forget(std::size_t k);

  bool named_ = false;
  std::size_t left_ = 0;  // points that are not settled: x, y and left_at_ [0, left_)
  std::vector<std::uint32_t> left_at_;
  Reached whole_, part_;  // the patch alone decides; the patch is one of several
  std::vector<double> rest_, sum_, low_, high_, worst_,
      most_;                                    // of all points; but for rest_ valid where reads_ > 0
  std::vector<std::uint32_t> reads_, touched_;  // patches read; points that went through part_
  std::size_t settled_ = 0, touches_ = 0;

  // The surfaces last used, by place modulo kHeld: the database's cache is shared and locked.
  static constexpr std::size_t kHeld = 64;
  std::array<std::shared_ptr<const PatchSurface>, kHeld> held_;
  std::array<std::uint32_t, kHeld> held_place_{};
};

}  // namespace patchwork
