// The seed of a random test: printed, and settable by PATCHWORK_SEED; and how much it tries, by
// PATCHWORK_TRIALS.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace patchwork {

inline std::uint64_t test_seed(std::uint64_t standard) {
  const char* given = std::getenv("PATCHWORK_SEED");
  const std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : standard;
  std::printf("PATCHWORK_SEED=%llu\n", static_cast<unsigned long long>(seed));
  return seed;
}

/// As often as PATCHWORK_TRIALS says, once at least; beside each call stands what the design asks for.
inline int test_trials(int standard) {
  const char* given = std::getenv("PATCHWORK_TRIALS");
  return given ? std::max(1, std::atoi(given)) : standard;
}

}  // namespace patchwork
