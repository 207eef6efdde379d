// A patch ready to be evaluated: its samples with one vertex around them, and what holes take from its
// weight.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "db/grid.h"

namespace patchwork {

/// Window coordinates: u = lattice i / 2^level - first_i, so that the block spans [3, 31] and the
/// cell that holds u is floor(u); an interpolant reads the vertices floor(u) - 1 .. floor(u) + 2.
struct PatchSurface {
  /// 41 vertices: the block's cells, its extension, the feather behind a grid's last block, one vertex
  /// around.
  static constexpr int kSide = kKernelCells + kExtensionCells + kFeatherCells + 3;

  /// What is known of the window's cells where some hold no data.
  struct Holes {
    std::array<std::uint8_t, kSide * kSide> answering{};  ///< of the cell that starts at the vertex: 1 or 0
    std::array<std::uint8_t, kSide * kSide> real{};       ///< the same
    /// Vertex: how far from cells without data, 0 at one to kFeatherCells where the weight is full; `near` of
    /// the vertex (k = 0), `wide` the least of it and its eight neighbours (k = 1, 2: a cubic B-spline
    /// spreads a vertex two cells wide).
    std::array<std::uint8_t, kSide * kSide> near{}, wide{};
  };

  PatchId id;
  int level = 0;
  double first_i = 0, first_j = 0;  ///< level lattice coordinates of window vertex (0, 0)
  LatticeRect kernel, domain;       ///< level-0 lattice coordinates
  std::array<float, kSide * kSide> codes{};
  std::unique_ptr<const Holes> holes;  ///< null for a patch without
};

/// Cells of one level, asked by lattice index. Indices beyond the grid mean its border cell.
class CellSource {
 public:
  virtual ~CellSource() = default;
  /// CellMasks::Cell bits of cells (i, j), (i + 1, j) ...
  virtual void row(int i, int j, std::span<std::uint8_t> out) const = 0;
};

/// The holes of the window of block (bx, by); null if no hole is in it or near enough to fade it.
std::unique_ptr<const PatchSurface::Holes> make_holes(const CellSource& cells, int level, int bx, int by);

/// What block (bx, by) can offer as cover: at most eight disjoint rectangles of cells at full weight, found
/// greedily.
Offer make_offer(const CellSource& cells, int level, int bx, int by);

}  // namespace patchwork
