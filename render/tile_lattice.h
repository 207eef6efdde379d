// The tiles of a domain: squares of a quadtree over one lattice, and the error that each level answers with.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "blend/blend.h"
#include "db/database.h"

namespace patchwork {

/// A square of the domain. Level 0 is the finest; the tiles of level l + 1 are 2 x 2 of level l.
struct TileKey {
  std::int32_t level = 0, x = 0, y = 0;
  auto operator<=>(const TileKey&) const = default;
  TileKey parent() const { return {level + 1, x >> 1, y >> 1}; }
  /// c: 0 to 3, the lower bit along x.
  TileKey child(int c) const { return {level - 1, 2 * x + (c & 1), 2 * y + (c >> 1)}; }
  /// Side s: 0 at smaller x, 1 at larger x, 2 at smaller y, 3 at larger y.
  TileKey beside(int s) const { return {level, x + (s == 1) - (s == 0), y + (s == 3) - (s == 2)}; }
};

/// All tiles share one lattice of half cells of level 0: vertex (2 c) of a tile is its vertex c, the ones
/// between are where it is measured. Tiles are a function of the database alone, never of a view, so that
/// what is made once serves every frame until the terrain changes.
class TileLattice {
 public:
  static constexpr int kCells = 64;                ///< of a tile along each side
  static constexpr int kVertices = kCells + 1;     ///< drawn
  static constexpr int kSamples = 2 * kCells + 1;  ///< measured, without the halo
  static constexpr int kMaxLevels = 23;            ///< half cells are counted in 31 bits

  TileLattice() = default;
  /// The step of level 0 is a fraction of the smallest of any grid (or as small as kMaxLevels allow). Where
  /// that grid lies upright, the vertices of its patches are half cells of all tiles that are no coarser. The
  /// tolerance of a level is the error that three quarters of the patches of its step keep to. Reads a
  /// bounded number of records.
  static TileLattice over(const Database& db);

  /// False where its root does not hold all data, or its finest step is larger than a grid's.
  bool fits(const Database& db) const;

  int levels() const { return int(errors_.size()); }
  TileKey root() const { return {levels() - 1, 0, 0}; }
  bool contains(const TileKey& k) const;
  double half_cell() const { return half_; }                             ///< metres, of level 0
  double step(int level) const;                                          ///< metres between vertices
  double error(int level) const { return errors_[std::size_t(level)]; }  ///< metres: of its uniform cut
  Point origin() const { return origin_; }                               ///< of half cell (0, 0), metres
  Extent bounds(const TileKey& k) const;                                 ///< metres
  /// Half cells: where vertex (0, 0) lies, and how many lie between measured samples.
  std::int32_t first_x(const TileKey& k) const { return (k.x * 2 * kCells) << k.level; }
  std::int32_t first_y(const TileKey& k) const { return (k.y * 2 * kCells) << k.level; }
  /// Where half cell (c, r) lies, for evaluators.
  RasterFrame frame() const { return {origin_.x, half_, 0, origin_.y, 0, half_}; }

 private:
  Point origin_;
  double half_ = 1;
  std::vector<double> errors_ = {0};
};

}  // namespace patchwork

template <>
struct std::hash<patchwork::TileKey> {
  std::size_t operator()(const patchwork::TileKey& k) const noexcept {
    std::uint64_t h = std::uint64_t(std::uint32_t(k.x)) << 32 | std::uint32_t(k.y);
    h = (h ^ std::uint64_t(k.level) << 58) * 0x9e3779b97f4a7c15u;
    return h ^ h >> 32;
  }
};
