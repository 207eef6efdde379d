// How times are taken on a machine that others use too.
#pragma once

#include <chrono>
#include <functional>
#include <span>
#include <vector>

namespace patchwork::cli {

/// Milliseconds of the stages, over the runs. What was not there to be measured has no values.
struct Stages {
  std::vector<double> query, fetch, blend, tessellate, draw, light;
  std::vector<double> total() const;    ///< of each run
  std::vector<double> at_hand() const;  ///< of each run, without fetch: patches are in memory
  void add(const Stages& runs);
};

/// A run of something: adds its times.
using MeasuredRun = std::function<void(Stages&)>;

struct Rounds {
  int least;                                    ///< visits of each
  std::chrono::steady_clock::time_point until;  ///< up to which there may be more
  std::function<void(double)> progress;         ///< told the share that is done
};

/// Visits each `least` times, and on until what counts of each is known to kSure of itself or the time has
/// come. What takes longer is visited less often, by the fourth root of its time: by its root would make the
/// most of the time for all medians together (Neyman 1934), but leave the longest to a few moments; and in
/// another order each time, so that a slower moment of the machine is not
/// always that of the same neighbours. Of each, the fastest quarter of its runs counts and is given out,
/// three at least: what others do on the machine only ever slows a run, and spread over all minutes each
/// setting meets calm moments.
std::vector<Stages> measure(std::span<const MeasuredRun> all, const Rounds& rounds);
inline constexpr double kSure = 0.02;  ///< between the fastest and the slowest that count

}  // namespace patchwork::cli
