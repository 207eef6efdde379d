#include "db/stopwatch.h"
#include "query/found.h"

namespace patchwork {

Extraction extract_grids(const Database& db, std::span<const GridId> grids, const Region& region) {
  const Stopwatch watch;
  const Database::Reading reading = db.reading();
  std::vector<FoundPatch> found;
  for (const GridId id : grids) {
    const Grid& grid = db.grid(id);
    const GridShape& shape = grid.info.shape;
    for (std::size_t k = 0; k < shape.blocks(); ++k) {
      const GridShape::Block b = shape.block(k);
      if (b.level != 0 || !region.meets(grid, b)) continue;
      const PatchRecord& p = grid.patches[k];
      if (p.exists())
        found.push_back(
            {p.bottom, shape.kernel(0, b.bx, b.by).area(), &grid, k, PatchId::make(id, 0, b.bx, b.by)});
    }
  }
  Extraction result = in_order(found);
  result.cost.seconds = watch.seconds();
  return result;
}

}  // namespace patchwork
