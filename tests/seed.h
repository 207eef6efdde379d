// The seed of a random test: printed, and settable by PATCHWORK_SEED.
#pragma once

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

}  // namespace patchwork
