// The first place where the surface comes up to a ray, and the places in between where it may (used by
// sight.cpp).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "blend/sight_path.h"

namespace patchwork {

/// A guarded search between two places: at the nearer one the surface is not above the ray, or has no data.
class HitSearch {
 public:
  /// The first two samples of a ray, ascending, between which the surface comes up to it by more than
  /// `touching` (metres); nothing where it does not. `end`: the width, as a parameter, at which the search is
  /// over.
  static std::optional<HitSearch> between(const std::vector<SightSample>& samples, double touching,
                                          double end);

  bool done() const { return high_ - low_ <= end_ || !(middle() > low_ && middle() < high_); }
  /// Where to look next: false position, and the middle after a step that did not halve the bracket.
  /// REQUIRES: !done().
  double guess() const;
  void take(double t, double above, double bound);

  double at() const { return high_; }  ///< the surface is above the ray here, and not `end` before
  double bound() const { return bound_; }
  double width() const { return high_ - low_; }
  std::uint32_t steps() const { return steps_; }

 private:
  double middle() const { return 0.5 * (low_ + high_); }
  double low_ = 0, high_ = 0, below_ = 0, above_ = 0;
  double touching_ = 0, bound_ = 0, end_ = 0;
  double width_before_ = 0;  // two steps ago
  std::uint32_t steps_ = 0;
  bool halve_ = false;
};

/// Where to look next, so that the surface is nowhere higher than what was seen by more than `miss` (metres),
/// does not rise above the ray by more than that before it was seen to, and is within its bounds of the ray
/// nowhere that was not seen, where that decides: peaks of parabolas through three neighbouring samples and,
/// where the surface is none, the middles between them.
void find_humps(const std::vector<SightSample>& samples, double miss,
                const std::function<void(double t, SightPlace)>& take);

}  // namespace patchwork
