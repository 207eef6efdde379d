#include "db/invariant.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace patchwork {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Below this share of the covered kernel's area no finer patches of another grid are asked (a smaller set of
// covers is allowed): it keeps the work bounded where a fine survey lies on a coarse map.
constexpr double kFinestShare = 1.0 / 4096;
constexpr double kAreaDoubt = 1e-12;    // relative; closer areas are compared exactly
constexpr double kGrowth = 1.0 / 1024;  // of a cell: by this a covering kernel is grown

// A cover and the bottom from which on it is one.
struct Cover {
  double bottom;
  OrientedRect rect;
};

struct Subject {
  const Grid& grid;
  std::size_t index;
  GridShape::Block block;
  const PatchRecord& patch;
  LatticeRect kernel;
  double area;  // square metres, rounded
  Extent bounds;
};

LatticeRect grown(LatticeRect r, int level) {
  const double g = std::ldexp(kGrowth, level);
  return {r.i0 - g, r.j0 - g, r.i1 + g, r.j1 + g};
}

class Search {
 public:
  Search(std::span<const Grid> grids, PatchPlace place, CoverageCounts& counts)
      : grids_(grids), place_(place), counts_(counts) {}

  Standing run() {
    const Grid& grid = grids_[place_.grid];
    const GridShape::Block block = grid.info.shape.block(place_.index);
    const LatticeRect kernel = grid.info.shape.kernel(block.level, block.bx, block.by);
    const Subject subject{grid,
                          place_.index,
                          block,
                          grid.patches[place_.index],
                          kernel,
                          kernel.area() * grid.info.frame.cell_area(),
                          grid.info.frame.bounds(kernel)};
    const CoverageCounts before = counts_;
    const Standing s{top(subject), best(subject)};
    if (before.interval == counts_.interval && before.exact == counts_.exact &&
        before.integer == counts_.integer)
      ++counts_.integer;  // decided within the grid's own lattice
    return s;
  }

 private:
  bool greater(const Grid& g, std::size_t index, const Subject& s) const {
    return less(s.grid, s.index, g, index, counts_);
  }

  // Greater patches of the subject's own grid are its ancestors and, at the border, the only child that is
  // left of four where it has the same kernel; each covers it whole.
  double top_within_grid(const Subject& s) const {
    const GridShape& shape = s.grid.info.shape;
    double top = kInfinity;
    const auto note = [&](std::size_t k) {
      const PatchRecord& p = s.grid.patches[k];
      if (p.exists() && p.bottom < top && greater(s.grid, k, s)) top = p.bottom;
    };
    for (int l = s.block.level + 1, bx = s.block.bx, by = s.block.by; l < shape.levels(); ++l) {
      bx /= 2, by /= 2;
      note(shape.index(l, bx, by));
    }
    for (int l = s.block.level - 1, bx = s.block.bx, by = s.block.by; l >= 0; --l) {
      bx *= 2, by *= 2;
      if (shape.kernel(l, bx, by).area() != s.kernel.area()) break;
      note(shape.index(l, bx, by));
    }
    return top;
  }

  double top(const Subject& s) {
    const double own = top_within_grid(s);
    covers_.clear();
    each_overlapping(s, [&](const Grid& g) {
      for (int l = g.info.shape.levels(); l-- > 0;) {
        const double largest = std::ldexp(std::pow(kKernelCells, 2), 2 * l) * g.info.frame.cell_area();
        if (largest < s.area * (1 - kAreaDoubt)) break;
        const BlockRange r = blocks_near(g.info, l, s.bounds);
        for (int by = r.j0; by <= r.j1; ++by)
          for (int bx = r.i0; bx <= r.i1; ++bx) {
            const std::size_t k = g.info.shape.index(l, bx, by);
            if (g.patches[k].exists() && g.patches[k].bottom < own && greater(g, k, s))
              offer(g, k, l, bx, by);
          }
      }
    });
    return std::min(own, smallest_covering_bottom(s));
  }

  bool best(const Subject& s) {
    covers_.clear();
    for (int l = s.block.level + 1, bx = s.block.bx, by = s.block.by; l < s.grid.info.shape.levels(); ++l) {
      bx /= 2, by /= 2;
      if (better(s.grid, s.grid.info.shape.index(l, bx, by), s)) return false;
    }
    if (s.block.level > 0 && own_children(s, s.block.level, s.block.bx, s.block.by)) return false;
    each_overlapping(s, [&](const Grid& g) { descend(g, g.info.shape.levels() - 1, 0, 0, s); });
    if (covers_.empty()) return true;
    return smallest_covering_bottom(s) == kInfinity;
  }

  bool better(const Grid& g, std::size_t index, const Subject& s) const {
    const PatchRecord& p = g.patches[index];
    return p.exists() && (p.bottom < s.patch.bottom || (p.bottom == s.patch.bottom && greater(g, index, s)));
  }

  // Do finer patches of the subject's own grid cover a block of it? Where a block is absent its cells hold no
  // data, and to know that is better than the coarse patch's fill. What is covered only in part is noted as
  // covers.
  bool own_children(const Subject& s, int level, int bx, int by) {
    const GridShape& shape = s.grid.info.shape;
    const int l = level - 1;
    bool all = true;
    for (int y = 2 * by; y < std::min(2 * by + 2, shape.blocks_j(l)); ++y)
      for (int x = 2 * bx; x < std::min(2 * bx + 2, shape.blocks_i(l)); ++x) {
        const std::size_t k = shape.index(l, x, y);
        const bool covered_here = !s.grid.patches[k].exists() || better(s.grid, k, s);
        if (covered_here)
          covers_.push_back({0, {&s.grid.info.frame, grown(shape.kernel(l, x, y), l)}});
        else if (l == 0 || !own_children(s, l, x, y))
          all = false;
      }
    return all;
  }

  // Better patches of another grid, coarse ones first: below a whole one nothing can be added.
  void descend(const Grid& g, int level, int bx, int by, const Subject& s) {
    const GridShape& shape = g.info.shape;
    const LatticeRect kernel = shape.kernel(level, bx, by);
    if (!g.info.frame.bounds(kernel).meets(s.bounds)) return;
    const std::size_t k = shape.index(level, bx, by);
    if (!g.patches[k].exists()) return;
    if (better(g, k, s)) {
      offer(g, k, level, bx, by);
      if (!g.patches[k].ragged()) return;
    }
    if (level == 0 || kernel.area() * g.info.frame.cell_area() < s.area * kFinestShare) return;
    for (int y = 2 * by; y < std::min(2 * by + 2, shape.blocks_j(level - 1)); ++y)
      for (int x = 2 * bx; x < std::min(2 * bx + 2, shape.blocks_i(level - 1)); ++x)
        descend(g, level - 1, x, y, s);
  }

  template <class Visit>
  void each_overlapping(const Subject& s, Visit visit) const {
    for (const Grid& g : grids_)
      if (&g != &s.grid && g.info.bounds().meets(s.bounds)) visit(g);
  }

  // Towards other grids a patch offers its kernel; a ragged one only the rectangles where it speaks with full
  // weight.
  void offer(const Grid& g, std::size_t index, int level, int bx, int by) {
    const LatticeRect kernel = g.info.shape.kernel(level, bx, by);
    const double bottom = g.patches[index].bottom;
    if (!g.patches[index].ragged()) {
      covers_.push_back({bottom, {&g.info.frame, grown(kernel, level)}});
      return;
    }
    const Offer* const o = g.patches.offer(index);
    if (!o) return;
    const double step = std::ldexp(1, level), i = bx * kKernelCells * step, j = by * kKernelCells * step;
    for (std::uint32_t c = 0; c < o->count; ++c) {
      const auto& cells = o->cells[c];
      const LatticeRect r{std::max(kernel.i0, i + cells[0] * step), std::max(kernel.j0, j + cells[1] * step),
                          std::min(kernel.i1, i + cells[2] * step), std::min(kernel.j1, j + cells[3] * step)};
      if (!r.empty()) covers_.push_back({bottom, {&g.info.frame, grown(r, level)}});
    }
  }

  // The smallest z such that the covers with bottom <= z cover the subject; infinity if not even all do.
  double smallest_covering_bottom(const Subject& s) {
    constexpr double none = kInfinity;
    if (covers_.empty()) return none;
    std::sort(covers_.begin(), covers_.end(),
              [](const Cover& a, const Cover& b) { return a.bottom < b.bottom; });
    rects_.clear();
    for (const Cover& c : covers_) rects_.push_back(c.rect);
    const OrientedRect target{&s.grid.info.frame, s.kernel};
    const auto enough = [&](std::size_t n) { return covered(target, std::span(rects_).first(n), counts_); };
    if (!enough(rects_.size())) return none;
    std::size_t low = 0, high = rects_.size();  // low covers are too few, high are enough
    while (high - low > 1) {
      const std::size_t middle = low + (high - low) / 2;
      (enough(middle) ? high : low) = middle;
    }
    return covers_[high - 1].bottom;
  }

  std::span<const Grid> grids_;
  PatchPlace place_;
  CoverageCounts& counts_;
  std::vector<Cover> covers_;
  std::vector<OrientedRect> rects_;
};

}  // namespace

bool less(const Grid& a, std::size_t ia, const Grid& b, std::size_t ib, CoverageCounts& counts) {
  const GridShape::Block p = a.info.shape.block(ia), q = b.info.shape.block(ib);
  const LatticeRect ka = a.info.shape.kernel(p.level, p.bx, p.by),
                    kb = b.info.shape.kernel(q.level, q.bx, q.by);
  if (&a == &b) {
    if (ka.area() != kb.area())
      return ka.area() < kb.area();  // exact: products of dyadic numbers of a few bits
  } else {
    const double x = ka.area() * a.info.frame.cell_area(), y = kb.area() * b.info.frame.cell_area();
    if (std::abs(x - y) > kAreaDoubt * std::max(x, y)) return x < y;
    if (const int sign = compare_areas({&a.info.frame, ka}, {&b.info.frame, kb}, counts)) return sign < 0;
  }
  const double za = a.patches[ia].bottom, zb = b.patches[ib].bottom;
  if (za != zb) return za > zb;
  if (a.info.digest != b.info.digest) return a.info.digest < b.info.digest;
  return ia < ib;
}

Standing standing(std::span<const Grid> grids, PatchPlace place, CoverageCounts& counts) {
  return Search(grids, place, counts).run();
}

}  // namespace patchwork
