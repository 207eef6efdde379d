// The name of a patch inside one database: grid, level and block in one ordered 64-bit key.
#pragma once

#include <compare>
#include <cstdint>

namespace patchwork {

/// The row of a grid in this database file (not part of any content).
struct GridId {
  static constexpr std::uint32_t kMost = 0x7ffe;
  std::uint32_t value = 0;
  auto operator<=>(const GridId&) const = default;
};

/// Grid (16 bits), level (6), block row (21), block column (21), packed so that ids sort by that order.
struct PatchId {
  std::uint64_t value = 0;

  static constexpr PatchId make(GridId grid, int level, int bx, int by) {
    return {std::uint64_t{grid.value} << 48 | std::uint64_t(level) << 42 | std::uint64_t(by) << 21 |
            std::uint64_t(bx)};
  }
  constexpr GridId grid() const { return {std::uint32_t(value >> 48)}; }
  constexpr int level() const { return int(value >> 42 & 63); }
  constexpr int by() const { return int(value >> 21 & 0x1fffff); }
  constexpr int bx() const { return int(value & 0x1fffff); }
  auto operator<=>(const PatchId&) const = default;
};

}  // namespace patchwork
