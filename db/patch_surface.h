// A patch ready to be evaluated: its samples with one vertex around them, and what holes take from its
// weight.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "db/grid.h"

namespace patchwork {

/// Window coordinates: u = lattice i / 2^level - first_i, so that the block's domain spans [1, 33] and the
/// cell that holds u is floor(u); an interpolant reads the vertices floor(u) - 1 .. floor(u) + 2.
struct PatchSurface {
  static constexpr int kSide =
      kKernelCells + 2 * kExtensionCells + 3;  ///< 35 vertices: 32 cells and one vertex around

  /// What is known of the window's cells where some hold no data.
  struct Holes {
    std::array<std::uint8_t, kSide * kSide> answering{};  ///< of the cell that starts at the vertex: 1 or 0
    std::array<std::uint8_t, kSide * kSide> real{};       ///< the same
    std::array<std::uint8_t, kSide * kSide>
        near{};  ///< vertex: every cell at it is real (weight factor, k = 0)
    std::array<std::uint8_t, kSide * kSide> wide{};  ///< vertex: every cell within two is real (k = 1, 2)
  };

  PatchId id;
  int level = 0;
  double first_i = 0, first_j = 0;  ///< level lattice coordinates of window vertex (0, 0)
  LatticeRect kernel, domain;       ///< level-0 lattice coordinates
  std::array<float, kSide * kSide> codes{};
  std::unique_ptr<const Holes> holes;  ///< null for a patch without
};

/// Cells within this distance of one without data are faded (and not offered as cover): what a cubic B-spline
/// reads.
inline constexpr int kHoleFadeCells = 3;

/// Cells of one level, asked by lattice index; true if real / answering. Indices beyond the grid mean its
/// border cell.
class CellSource {
 public:
  virtual ~CellSource() = default;
  virtual std::uint8_t cell(int i, int j) const = 0;  ///< CellMasks::Cell bits
};

/// The holes of the window of block (bx, by); null if every cell of the window and around it is real.
std::unique_ptr<const PatchSurface::Holes> make_holes(const CellSource& cells, int bx, int by);

/// What block (bx, by) can offer as cover: at most eight disjoint rectangles of cells at full weight, found
/// greedily.
Offer make_offer(const CellSource& cells, int bx, int by);

}  // namespace patchwork
