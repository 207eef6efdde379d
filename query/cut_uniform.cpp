// The uniform cut: one tolerance for a whole region.
#include "query/ranged_surface.h"

namespace patchwork {

namespace {

class UniformSurface : public CutSurface {
 public:
  explicit UniformSurface(const UniformCut& cut) : cut_(cut), limit_(float_at_most(cut.error)) {}
  double at(Point) const override { return cut_.error; }
  ToleranceRange over(const Frame&, const LatticeRect&) const override { return {cut_.error, cut_.error}; }
  bool meets(const Grid& g, const GridShape::Block& b) const override { return cut_.region.meets(g, b); }
  LodHits hits(const LodPage& page, bool inside) const override {
    return page.uniform_hits(cut_.region.bounds(), limit_, inside);
  }

 private:
  UniformCut cut_;
  float limit_;
};

}  // namespace

std::unique_ptr<CutSurface> make_surface(const UniformCut& cut) {
  require(is_error(cut.error), "error", "it must be a number of metres, 0 or more");
  return std::make_unique<UniformSurface>(cut);
}

}  // namespace patchwork
