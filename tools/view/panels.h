// What lies over the window: tables of figures and keys, and a map of the tiles.
#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "render/camera.h"
#include "render/picture.h"
#include "render/renderer.h"

namespace patchwork::cli {

/// A name and what stands at the right edge; an empty name and value: a gap.
using Rows = std::vector<std::pair<std::string, std::string>>;
Image table_panel(const std::string& title, const Rows& rows, int width);

struct TileMap {
  Extent place;                                ///< of the map, metres
  std::span<const TileKey> tiles;              ///< that are drawn
  std::vector<std::array<Point, 4>> outlines;  ///< of grids
  Camera camera;
};
/// Tiles in colours of their level, outlines of grids over them, and where the camera looks.
Image map_panel(const TileLattice& lattice, const TileMap& map);

/// What the effects' colours stand for, cut out of a picture of that size; empty where nothing does.
Image legend_panel(const Renderer& renderer, int width, int height);

}  // namespace patchwork::cli
