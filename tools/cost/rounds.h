// How times are taken on a machine that others use too.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace patchwork::cli {

/// How slow the machine's memory is just now. Virtual machines share caches and memory with neighbours: the
/// same work was measured to take up to 1.4 times as long for minutes, while arithmetic stayed within 2 %.
class MemoryProbe {
 public:
  MemoryProbe();
  /// Milliseconds of a walk from place to place in 64 MB, each step waiting for the one before.
  double operator()();

 private:
  static constexpr std::uint32_t kPlaces = 1u << 24;
  static constexpr int kSteps = 10000;
  std::vector<std::uint32_t> next_;
  std::uint32_t at_ = 0;
};

/// Milliseconds of the stages, over the runs. What was not there to be measured has no values.
struct Stages {
  std::vector<double> query, fetch, blend, tessellate, draw, light;
  std::vector<double> total() const;    ///< of each run
  std::vector<double> at_hand() const;  ///< of each run, without fetch: patches are in memory
};

/// A run of something: adds its times.
using MeasuredRun = std::function<void(Stages&)>;

struct Rounds {
  int least;                                    ///< measured rounds
  std::chrono::steady_clock::time_point until;  ///< up to which there may be more
  std::function<double()> disturbance;          ///< of the machine at this moment, in any unit
  std::function<void(double)> progress;         ///< told the share that is done
};

/// Runs each in turn, A B C A B C: once to warm up, then `least` times, and on until the median of each is
/// known to kSure of itself, the time has come, or kMostRuns were made. Of each, the half of its runs is
/// given out before which the machine was least disturbed.
std::vector<Stages> measure(std::span<const MeasuredRun> all, const Rounds& rounds);
inline constexpr double kSure = 0.015;  ///< standard error
inline constexpr int kMostRuns = 100;

}  // namespace patchwork::cli
