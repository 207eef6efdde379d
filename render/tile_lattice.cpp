#include "render/tile_lattice.h"

#include <algorithm>
#include <cmath>

namespace patchwork {

namespace {

// Levels below the finest grid's step, where a smooth surface may still bend, or a finer survey may come; and
// above the one that holds all data, so that some may come beside it.
constexpr int kFiner = 5, kLarger = 1;
constexpr std::size_t kRuns = 6, kRun = 64;  // records of a level that are looked at: runs of neighbours

// Bottoms of some patches of a level, but for those of flat ground, which say nothing of what the level
// misses.
void sample_bottoms(const Grid& grid, int level, std::vector<double>& bottoms) {
  const GridShape& shape = grid.info.shape;
  const std::size_t first = shape.index(level, 0, 0);
  const std::size_t n = std::size_t(shape.blocks_i(level)) * std::size_t(shape.blocks_j(level));
  const double flat = grid.info.accuracy + grid.info.quantisation;
  const auto take = [&](std::size_t k) {
    const PatchRecord p = grid.patches[first + k];
    if (p.exists() && p.bottom > flat) bottoms.push_back(p.bottom);
  };
  if (n <= kRuns * kRun) {
    for (std::size_t k = 0; k < n; ++k) take(k);
    return;
  }
  for (std::size_t r = 0; r < kRuns; ++r)
    for (std::size_t k = 0; k < kRun; ++k) take((n - kRun) * r / (kRuns - 1) + k);
}

double upper_quartile(std::vector<double>& v) {
  const auto at = v.begin() + std::ptrdiff_t(v.size() * 3 / 4);
  std::nth_element(v.begin(), at, v.end());
  return *at;
}

}  // namespace

double TileLattice::step(int level) const { return std::ldexp(2 * half_, level); }

bool TileLattice::contains(const TileKey& k) const {
  if (k.level < 0 || k.level >= levels()) return false;
  const std::int32_t side = std::int32_t{1} << (levels() - 1 - k.level);
  return k.x >= 0 && k.y >= 0 && k.x < side && k.y < side;
}

Extent TileLattice::bounds(const TileKey& k) const {
  const double side = kCells * step(k.level);
  const double x = origin_.x + k.x * side, y = origin_.y + k.y * side;
  return {x, y, x + side, y + side};
}

bool TileLattice::fits(const Database& db) const {
  const Extent root = bounds(this->root()), data = db.extent();
  for (const Grid& g : db.grids())
    if (g.info.frame.finer_step() < step(0) * 0.99 && levels() < kMaxLevels) return false;
  return root.contains({data.xmin, data.ymin}) && root.contains({data.xmax, data.ymax});
}

TileLattice TileLattice::over(const Database& db) {
  TileLattice t;
  if (db.grids().empty()) return t;
  const Database::Reading reading = db.reading();
  const Extent e = db.extent();
  const Grid* finest = &db.grids().front();
  for (const Grid& g : db.grids())
    if (g.info.frame.finer_step() < finest->info.frame.finer_step()) finest = &g;
  const double side = std::max(e.xmax - e.xmin, e.ymax - e.ymin);
  double step = std::ldexp(finest->info.frame.finer_step(), -kFiner);
  while (std::ldexp(kCells * step, kMaxLevels - 1 - kLarger) < side + step) step *= 2;
  int levels = 1;
  while (std::ldexp(kCells * step, levels - 1 - kLarger) < side + step) ++levels;
  // All data lie in the root, about in its middle. The finest grid's first sample is a corner of large tiles:
  // where it lies upright, its samples are measured positions on every level, as far as these are no finer
  // than its lattice.
  const Point anchor = finest->info.frame.to_domain(0, 0);
  const double root = std::ldexp(kCells * step, levels - 1), tile = root / 4;
  const auto before = [&](double from, double low, double high) {
    return from - std::nearbyint((from - (low + high - root) / 2) / tile) * tile;
  };
  t.half_ = 0.5 * step, t.origin_ = {before(anchor.x, e.xmin, e.xmax), before(anchor.y, e.ymin, e.ymax)};
  std::vector<std::vector<double>> bottoms(static_cast<std::size_t>(levels));
  for (const Grid& g : db.grids())
    for (int l = 0; l < g.info.shape.levels(); ++l) {
      const double octave = std::log2(g.info.frame.finer_step() / step) + l;
      const int level = std::clamp(int(std::ceil(octave - 0.01)), 0, levels - 1);
      sample_bottoms(g, l, bottoms[std::size_t(level)]);
    }
  // The levels up to the finest step answer with the best there is, one without patches of its step with
  // twice the error of the level below.
  t.errors_.assign(std::size_t(levels), 0);
  for (int l = kFiner + 1; l < levels; ++l) {
    auto& own = bottoms[std::size_t(l - 1)];
    const double below = t.errors_[std::size_t(l - 1)];
    t.errors_[std::size_t(l)] = own.empty() ? 2 * below : std::max(below, upper_quartile(own));
  }
  return t;
}

}  // namespace patchwork
