// How often settings are measured.
#include <algorithm>
#include <cmath>

#include "tools/cost/cost.h"

namespace patchwork::cli {

namespace {

using Clock = std::chrono::steady_clock;

// Standard error of the median, as part of it, from the middle half of the values.
double doubt_of_median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return 1.2533 / 1.349 * (values[3 * n / 4] - values[n / 4]) / std::sqrt(double(n)) / values[n / 2];
}

}  // namespace

void measure(std::vector<Measurable>& all, int runs, Clock::time_point until,
             const std::function<void(double)>& progress) {
  const auto unsure = [](const Measurable& m) { return doubt_of_median(m.row.ms.total()) > kSure; };
  const auto start = Clock::now();
  auto round = Clock::duration::zero();  // the longest
  for (int done = 0; done <= kMostRuns; ++done) {
    const auto now = Clock::now();
    if (done > runs && (now + round > until || std::none_of(all.begin(), all.end(), unsure))) break;
    for (std::size_t k = 0; k < all.size(); ++k) {
      Stages warming_up;
      all[k].once(done > 0 ? all[k].row.ms : warming_up);
      const double by_runs = (done + double(k) / double(all.size())) / (runs + 1),
                   by_time = until > start ? (Clock::now() - start) * 1. / (until - start) : 1;
      progress(std::clamp(by_time, 0., std::min(1., by_runs)));  // the later of both
    }
    round = std::max(round, Clock::now() - now);
  }
}

}  // namespace patchwork::cli
