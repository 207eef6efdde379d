// How drawn tiles meet: which of them owns the vertices of a shared edge, and whose blocks decide its factor.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "render/tile_selection.h"

namespace patchwork {

/// What shaders know of a drawn tile (vulkan/terrain.glsl: texels of a draw). Heights are texels of one
/// buffer, kVertices x kVertices a slot, row-major; vertices of a tile's border are read from the finest tile
/// that they belong to (of several the first by y, then x), so that all who share a vertex read the same
/// bits, whatever each was made from. Positions along a side count half cells of this tile, 0 to 128.
struct TileDraw {
  std::int32_t x = 0, y = 0;  ///< half cells of the lattice, relative to the eye's: vertex (0, 0)
  std::uint32_t stride = 1;   ///< half cells of the lattice in one of this tile
  std::uint32_t slot = 0;
  struct Side {
    std::uint32_t near, far;  ///< texels of positions 0 and 64, where each half begins
    std::uint32_t step;       ///< texels from vertex to vertex
    bool operator==(const Side&) const = default;
    std::uint32_t fine;  ///< bit h: half h has a vertex at every position, else at every other
  };
  std::array<Side, 4> sides;             ///< by TileKey::beside
  std::array<std::uint32_t, 4> corners;  ///< texels; the lower bit of a corner is along x
  std::array<std::uint32_t, 4> middles;  ///< texels: position 64 of each side
  /// Of each side: the draws whose blocks share its first and its second half's edges; kAlone for none.
  std::array<std::uint32_t, 4> beside_near, beside_far;
  float patches = 0;  ///< that the tile was made of
  std::uint32_t holes = 0;
  std::uint32_t effects = 0;  ///< what the gate said of it
  std::uint32_t unused = 0;
  bool operator==(const TileDraw&) const = default;

  static constexpr std::uint32_t kAlone = 0xffffffffu;
  /// With a draw's number: it is larger, and this tile lies at its second half.
  static constexpr std::uint32_t kLarger = 0x80000000u, kSecondHalf = 0x40000000u, kFiner = 0x20000000u;
};
static_assert(sizeof(TileDraw) == 10 * 16);

/// A vertex of a mesh of drawn tiles: which draw, and its half cells there.
struct MeshVertex {
  std::uint32_t draw;
  std::int32_t x, y;
};

/// Which effects can matter to a tile, as bits that mean nothing here.
using TileGate = std::function<std::uint32_t(const TileKey&, const TileFacts&)>;

/// A draw for each drawn leaf: those without holes, then those that have some or share their vertices; of
/// these, all of the same effects one after the other, nearest to the eye first. `draws` is overwritten.
void make_draws(const TileLattice& lattice, const Selection& selection, const TileCache& cache, Point eye,
                std::vector<TileDraw>& draws, const TileGate& gate = {});

/// The half cell at or before a point: what TileDraw::x and y are relative to.
std::array<std::int32_t, 2> half_cell_at(const TileLattice& lattice, Point p);

}  // namespace patchwork
