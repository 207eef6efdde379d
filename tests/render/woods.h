// What the tests of tiles share: a terrain, and trees of tiles that need none.
#pragma once

#include <algorithm>
#include <random>

#include "render/tile_cache.h"
#include "tests/blend/scene.h"

namespace patchwork {

inline const Land& land() {
  static const Land l(surveys());
  return l;
}

/// A cache in which tiles of random roughness exist, to a random depth, whatever the terrain.
class Woods {
 public:
  explicit Woods(std::uint64_t seed) : random_(seed), lattice_(TileLattice::over(land().db())) {
    grow(lattice_.root(), 1);
  }

  const TileLattice& lattice() const { return lattice_; }
  TileCache cache{4000, TilePolicy::lru};

  Camera camera() {
    const Extent e = land().db().extent();
    std::uniform_real_distribution<double> x(e.xmin, e.xmax), y(e.ymin, e.ymax), z(320, 800), d(-500, 500);
    const Point3 eye{x(random_), y(random_), z(random_)};
    return {eye, {eye.x + d(random_), eye.y + d(random_), eye.z - 200}, 60, 640, 360};
  }

 private:
  void grow(const TileKey& key, double share) {
    const auto chance = [&](double p) { return double(random_() % 1000) < 1000 * p; };
    if (key.level + 3 < lattice_.levels() && chance(0.05)) {
      cache.put(key, {}, TileCache::kNoSlot);
      return;
    }
    TileFacts f;
    f.lowest = 200, f.highest = 400, f.holes = (key.x + 3 * key.y + key.level) % 11 == 0;
    for (TileFacts::Part& part : f.parts) {
      part = {lattice_.step(key.level) * 0.1 * (0.2 + double(random_() % 100) / 50), {200, 400}};
      f.error = std::max(f.error, part.error);
    }
    cache.put(key, f, cache.take_slot(key));
    if (key.level > lattice_.levels() - 7 && chance(share))
      for (int c = 0; c < 4; ++c) grow(key.child(c), 0.9);
  }
  std::mt19937_64 random_;
  TileLattice lattice_;
};

}  // namespace patchwork
