// How often settings are measured, and which of their runs count.
#include "tools/cost/rounds.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace patchwork::cli {

namespace {

using Clock = std::chrono::steady_clock;

std::vector<double> sum(std::initializer_list<const std::vector<double>*> parts) {
  std::vector<double> all;
  for (const std::vector<double>* part : parts) {
    all.resize(std::max(all.size(), part->size()));
    for (std::size_t r = 0; r < part->size(); ++r) all[r] += (*part)[r];
  }
  return all;
}

// Standard error of the median, as part of it, from the middle half of the values.
double doubt_of_median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return 1.2533 / 1.349 * (values[3 * n / 4] - values[n / 4]) / std::sqrt(double(n)) / values[n / 2];
}

// The half of the runs with the least disturbance; of an odd number the larger half.
void keep_calmer_half(Stages& ms, const std::vector<double>& disturbance) {
  std::vector<std::size_t> runs(disturbance.size());
  std::iota(runs.begin(), runs.end(), std::size_t{0});
  std::stable_sort(runs.begin(), runs.end(),
                   [&](std::size_t a, std::size_t b) { return disturbance[a] < disturbance[b]; });
  runs.resize((runs.size() + 1) / 2);
  for (std::vector<double>* stage : {&ms.query, &ms.fetch, &ms.blend, &ms.tessellate, &ms.draw, &ms.light}) {
    if (stage->empty()) continue;
    std::vector<double> kept;
    for (const std::size_t r : runs) kept.push_back((*stage)[r]);
    *stage = std::move(kept);
  }
}

}  // namespace

std::vector<double> Stages::total() const {
  return sum({&query, &fetch, &blend, &tessellate, &draw, &light});
}
std::vector<double> Stages::at_hand() const { return sum({&query, &blend, &tessellate, &draw, &light}); }

MemoryProbe::MemoryProbe() : next_(kPlaces) {
  // One cycle through all places: a full period, Knuth, The Art of Computer Programming 2, 3.2.1.2, theorem
  // A.
  for (std::uint32_t i = 0; i < kPlaces; ++i) next_[i] = (i * 1664525u + 1013904223u) % kPlaces;
}

double MemoryProbe::operator()() {
  const auto start = Clock::now();
  for (int k = 0; k < kSteps; ++k) at_ = next_[at_];
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::vector<Stages> measure(std::span<const MeasuredRun> all, const Rounds& rounds) {
  const auto start = Clock::now();
  const std::size_t n = all.size();
  std::vector<Stages> times(n);
  std::vector<std::vector<double>> disturbance(n);
  const auto unsure = [](const Stages& ms) { return doubt_of_median(ms.total()) > kSure; };
  auto longest = Clock::duration::zero();
  for (int done = 0; done <= kMostRuns; ++done) {
    const auto now = Clock::now();
    if (done > rounds.least &&
        (now + longest > rounds.until || std::none_of(times.begin(), times.end(), unsure)))
      break;
    // Each begins elsewhere, lest what comes and goes as often as a round always meets the same runs.
    const auto first = std::size_t(double(n) * std::fmod(0.618 * done, 1));
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t which = (first + k) % n;
      Stages warming_up;
      if (done > 0) disturbance[which].push_back(rounds.disturbance());
      all[which](done > 0 ? times[which] : warming_up);
      const double by_runs = (done + double(k) / double(n)) / (rounds.least + 1),
                   by_time = rounds.until > start ? (Clock::now() - start) * 1. / (rounds.until - start) : 1;
      rounds.progress(std::clamp(by_time, 0., std::min(1., by_runs)));  // the later of both
    }
    longest = std::max(longest, Clock::now() - now);
  }
  for (std::size_t k = 0; k < n; ++k) keep_calmer_half(times[k], disturbance[k]);
  return times;
}

}  // namespace patchwork::cli
