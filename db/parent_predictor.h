// Samples of a chunk predicted from those of the level above, which holds every other of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace patchwork {

/// A chunk of the level above and where in it a chunk begins: vertex (x, y) of the chunk, both even, lies at
/// vertex (i + x / 2, j + y / 2) of the parent.
struct ParentCodes {
  std::span<const std::int32_t> codes;  ///< row-major, cols * rows of them
  int cols = 0, rows = 0;
  int i = 0, j = 0;
  /// Whether all even vertices of a cols * rows chunk lie in the parent.
  bool covers(int chunk_cols, int chunk_rows) const;
};

/// What a chunk is beyond its parent. All arithmetic is modulo 2^32, so any codes are allowed.
struct BeyondParent {
  /// Weight of the eight outer neighbours against the four inner ones, in 128ths: of vertices odd in both
  /// directions, and of those odd in one.
  std::int8_t centre_weight = 0, edge_weight = 0;
  std::vector<std::int32_t> even;  ///< at the even vertices less the parent's; zero but at a level's far ends
  std::vector<std::int32_t> odd;   ///< less their prediction: centres, edges along i, edges along j

  /// Sizes `even` and `odd` for a chunk.
  void resize(int cols, int rows);
};

/// REQUIRES (both): parent.covers(cols, rows), codes are cols * rows.
void subtract_parent(std::span<const std::int32_t> codes, int cols, int rows, const ParentCodes& parent,
                     BeyondParent& out);
void add_parent(const BeyondParent& beyond, int cols, int rows, const ParentCodes& parent,
                std::span<std::int32_t> out);

}  // namespace patchwork
