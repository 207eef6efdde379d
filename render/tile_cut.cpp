#include "render/tile_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace patchwork {

namespace {

Extent united_of(const std::vector<Extent>& all) {
  Extent u = Extent::nothing();
  for (const Extent& e : all) u.add(e);
  return u;
}

}  // namespace

TileCut::TileCut(double error, const std::vector<Extent>& places)
    : error_(error), limit_(float_at_most(error)), all_(united_of(places)) {
  for (const Extent& e : places) places_.push_back(Region::inside(e));
}

bool TileCut::meets(const Grid& grid, const GridShape::Block& b) const {
  return std::any_of(places_.begin(), places_.end(), [&](const Region& r) { return r.meets(grid, b); });
}

LodHits TileCut::hits(const LodPage& page, bool) const {
  LodHits hits = page.uniform_hits(all_, limit_, false);
  hits.inside = 0;
  if (places_.size() == 1) return hits;
  for (std::uint64_t left = hits.met; left != 0; left &= left - 1) {
    const int s = std::countr_zero(left);
    const Extent box{page.xmin[s], page.ymin[s], page.xmax[s], page.ymax[s]};
    if (std::none_of(places_.begin(), places_.end(), [&](const Region& r) { return r.bounds().meets(box); }))
      hits.met &= ~(std::uint64_t{1} << s);
  }
  return hits;
}

bool is_improvable(const Database& db, const std::vector<PatchId>& patches, const Extent& place) {
  bool better = false;
  const Database::Reading reading = db.reading();
  db.tree().visit(
      [&](const LodPage& page, bool) {
        LodHits hits = better ? LodHits{} : page.uniform_hits(place, 0, false);
        hits.inside = 0;
        return hits;
      },
      [&](const LodEntry& e) { better |= !std::binary_search(patches.begin(), patches.end(), e.id); });
  return better;
}

}  // namespace patchwork
