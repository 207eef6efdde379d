// How often settings are measured, and which of their runs count.
#include "tools/cost/rounds.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace patchwork::cli {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kLeastThatCount = 3;

std::vector<double> sum(std::initializer_list<const std::vector<double>*> parts) {
  std::vector<double> all;
  for (const std::vector<double>* part : parts) {
    all.resize(std::max(all.size(), part->size()));
    for (std::size_t r = 0; r < part->size(); ++r) all[r] += (*part)[r];
  }
  return all;
}

// The runs that count, fastest first.
std::vector<std::size_t> middle_half(const Stages& ms) {
  const std::vector<double> total = ms.total();
  std::vector<std::size_t> runs(total.size());
  std::iota(runs.begin(), runs.end(), std::size_t{0});
  std::stable_sort(runs.begin(), runs.end(),
                   [&](std::size_t a, std::size_t b) { return total[a] < total[b]; });
  const std::size_t spare = runs.size() - std::min(runs.size(), kLeastThatCount);
  const auto off = std::ptrdiff_t(std::min(runs.size() / 4, spare / 2));  // each end
  return {runs.begin() + off, runs.end() - off};
}

bool sure(const Stages& ms) {
  const std::vector<double> total = ms.total();
  const std::vector<std::size_t> runs = middle_half(ms);
  return total[runs.back()] <= (1 + kSure) * total[runs.front()];
}

void keep_middle_half(Stages& ms) {
  const std::vector<std::size_t> runs = middle_half(ms);
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

std::vector<Stages> measure(std::span<const MeasuredRun> all, const Rounds& rounds) {
  const auto start = Clock::now();
  const std::size_t n = all.size();
  std::vector<Stages> times(n);
  auto longest = Clock::duration::zero();
  for (int done = 0; done < kMostRuns; ++done) {
    const auto now = Clock::now();
    if (done >= rounds.least &&
        (now + longest > rounds.until || std::all_of(times.begin(), times.end(), sure)))
      break;
    // Each begins elsewhere, lest what comes and goes as often as a round always meets the same runs.
    const auto first = std::size_t(double(n) * std::fmod(0.618 * done, 1));
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t which = (first + k) % n;
      all[which](times[which]);
      const double by_runs = (done + double(k) / double(n)) / rounds.least,
                   by_time = rounds.until > start ? (Clock::now() - start) * 1. / (rounds.until - start) : 1;
      rounds.progress(std::clamp(by_time, 0., std::min(1., by_runs)));  // the later of both
    }
    longest = std::max(longest, Clock::now() - now);
  }
  for (Stages& ms : times) keep_middle_half(ms);
  return times;
}

}  // namespace patchwork::cli
