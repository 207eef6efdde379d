// What cuts share whose range over an upright rectangle is all that one has of them (used by cut*.cpp).
#pragma once

#include <cmath>

#include "db/error.h"
#include "query/cut.h"

namespace patchwork {

/// A cut over a region that is asked box by box.
class RangedSurface : public CutSurface {
 public:
  explicit RangedSurface(Region region) : region_(std::move(region)) {}

  bool meets(const Grid& g, const GridShape::Block& b) const override { return region_.meets(g, b); }
  LodHits hits(const LodPage& page, bool inside) const override {
    std::uint8_t hit[LodPage::kSlots] = {};
    for (std::uint32_t s = 0; s < page.count; ++s) {
      const LodBox b = page.box(s);
      const Extent place{b.xmin, b.ymin, b.xmax, b.ymax};
      if (!inside && !place.meets(region_.bounds())) continue;
      const ToleranceRange r = within(place);
      hit[s] = double(b.bottom) <= r.high && r.low < double(b.top);
    }
    return {page.mask_of_used(hit)};
  }

 protected:
  /// Holds every tolerance in the closed rectangle; the tighter the better.
  virtual ToleranceRange within(const Extent& place) const = 0;

 private:
  Region region_;
};

inline void require(bool holds, const char* what, const char* problem) {
  if (!holds) throw Error(what, problem);
}
inline bool is_error(double e) { return e >= 0 && std::isfinite(e); }

}  // namespace patchwork
