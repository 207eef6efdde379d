// Which patch and which grid answers where, in colours.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "render/picture.h"

namespace patchwork {

/// What is to be drawn; the spans hold width * height values, row-major from the north.
struct PatchMapInput {
  int width = 0, height = 0;  ///< pixels of the input
  /// Side of the answering patch's kernel; where it is not finite or not above 0, nothing answers.
  std::span<const float> kernel_metres{};
  std::span<const std::uint16_t> grid{};   ///< index into `grid_names`
  std::span<const std::uint8_t> filled{};  ///< non-zero: only filled cells answer; may be empty (none)
  std::vector<std::string> grid_names{};
  /// Kernels, in pixels of the input ((0, 0) is the outer corner of the first).
  std::vector<std::array<Point, 4>> outlines{};
  std::string title{};     ///< one line
  double step_metres = 0;  ///< of a pixel, for the scale bar; 0: no bar
};

/// Two panels: patch sizes (small red, large blue; outlines on it) and grids, each with its legend and the
/// share of the area. At most eight grids have a colour of their own, the others share grey. Throws Error: a
/// size below 1 x 1, spans of another size, a grid index without a name.
Image patch_map(const PatchMapInput& input);

}  // namespace patchwork
