// The cut that tiles of one level are made from: one error, over the places of some tiles.
#pragma once

#include <vector>

#include "query/cut.h"

namespace patchwork {

/// A uniform cut over a union of upright rectangles, so that tiles in several places share an extraction.
class TileCut : public CutSurface {
 public:
  /// `error`: metres. REQUIRES: `places` is not empty.
  TileCut(double error, const std::vector<Extent>& places);
  double at(Point) const override { return error_; }
  ToleranceRange over(const Frame&, const LatticeRect&) const override { return {error_, error_}; }
  bool meets(const Grid& grid, const GridShape::Block& block) const override;
  LodHits hits(const LodPage& page, bool inside) const override;

 private:
  double error_;
  float limit_;
  std::vector<Region> places_;
  Extent all_;
};

/// True where a better answer than `patches` (ascending ids) exists over `place`: some patch of the best
/// there is is none of them. Stops at the first.
bool is_improvable(const Database& db, const std::vector<PatchId>& patches, const Extent& place);

}  // namespace patchwork
