// Opens a database and asks it with each of the libraries: a height, its bound, and which tiles a view needs.
#include <cmath>
#include <cstdio>

#include "blend/blend.h"
#include "db/database.h"
#include "query/extract.h"
#include "render/frustum.h"
#include "render/tile_lattice.h"

int main(int, char** arguments) {
  using namespace patchwork;
  const Database db = Database::open(arguments[1]);
  const Extent e = db.extent();
  const Extraction found = extract(db, {.error = 5});
  const double x = (e.xmin + e.xmax) / 2, y = (e.ymin + e.ymax) / 2;
  double height = NAN, bound = NAN;
  Blend(db, found.patches, {})
      .at_points({&x, 1}, {&y, 1}, {.height = {&height, 1}, .bound = {&bound, 1}, .source = {}, .patch = {}});
  const TileLattice tiles = TileLattice::over(db);
  const Frustum frustum({{x, y, height + 100}, {x + 100, y, height}, 60, 1280, 720}, 0, 1e5);
  const bool seen = frustum.sees({tiles.bounds(tiles.root()), height - 100, height + 100});
  std::printf("%zu patches, %.2f m to within %.2f m, %d levels of tiles%s\n", found.patches.size(), height,
              bound, tiles.levels(), seen ? "" : " out of sight");
  return !found.patches.empty() && std::isfinite(height) && bound <= 5 && seen ? 0 : 1;
}
