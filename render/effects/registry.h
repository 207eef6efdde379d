// The effects there are, each in a line: its name, when a scene calls for it, which tiles it can matter to.
#pragma once

#include <bitset>
#include <span>

#include "render/effects/gate.h"
#include "render/scene.h"

namespace patchwork::effects {

enum class Id {
  sun,
  shadow,
  sky,
  water,
  haze,
  curvature,
  solar_disc,
  tints,
  contours,
  error,
  source,
  cost,
  wireframe
};
inline constexpr std::size_t kEffects = 13;
using Set = std::bitset<kEffects>;
inline bool has(const Set& s, Id id) { return s[std::size_t(id)]; }

struct Entry {
  Id id;
  const char* name;  ///< as in a scene
  /// Scene gate: named, and possible.
  bool (*called)(const Scene& scene, const SceneView& view);
  /// Tile gate: false only if it changes no pixel of the tile by more than kInvisible. REQUIRES: named.
  bool (*matters)(const Scene& scene, const TileView& tile);
};

/// In the order of Id.
std::span<const Entry> registry();
/// What a frame needs, and nothing else.
Set called_for(const Scene& scene, const SceneView& view);
/// What of `frame` a tile needs.
Set matter_to(const Scene& scene, const Set& frame, const TileView& tile);

}  // namespace patchwork::effects
