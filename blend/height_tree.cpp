#include "blend/height_tree.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "db/basis.h"
#include "db/float_rounding.h"

namespace patchwork {

namespace {

constexpr int kSide = PatchSurface::kSide;
constexpr float kNothing = -std::numeric_limits<float>::infinity();

// The largest of `sign` (1 or -1) times the codes that an interpolant takes over cells [i0, i1) x [j0, j1)
// (window): the largest sample and, where it is not linear, an eighth of the largest second differences it
// reads; those across rows once more by what the rows' own weights add up to (db/basis.h).
double most_of(const float* codes, double sign, int i0, int j0, int i1, int j1, int smoothness) {
  const auto at = [&](int i, int j) { return sign * double(codes[j * kSide + i]); };
  double most = -INFINITY, along = 0, across = 0;
  for (int j = j0; j <= j1; ++j)
    for (int i = i0; i <= i1; ++i) most = std::max(most, at(i, j));
  if (smoothness == 0) return most;
  const int a0 = std::max(i0 - 1, 0), a1 = std::min(i1 + 1, kSide - 1);
  const int b0 = std::max(j0 - 1, 0), b1 = std::min(j1 + 1, kSide - 1);
  for (int j = b0; j <= b1; ++j)
    for (int i = a0; i <= a1; ++i) {
      if (i > a0 && i < a1) along = std::max(along, std::abs(at(i - 1, j) - 2 * at(i, j) + at(i + 1, j)));
      if (j > b0 && j < b1) across = std::max(across, std::abs(at(i, j - 1) - 2 * at(i, j) + at(i, j + 1)));
    }
  return most + kDepartureFromLinear * (along + (kInnerWeights + kOuterWeights) * across);
}

}  // namespace

LatticeRect HeightTree::block(int i, int j) {
  const auto low = [](int k) { return k == 0 ? 0.0 : 1.0 + k * kCells; };
  const auto high = [](int k) { return k + 1 == kBlocks ? double(kSide) : 1.0 + (k + 1) * kCells; };
  return {low(i), low(j), high(i), high(j)};
}

HeightTree::HeightTree(const Database& db, const std::vector<Blend::Placed>& placed, int smoothness)
    : highest_(placed.size()) {
  std::vector<float> top(placed.size());
  std::vector<std::size_t> by_place(placed.size());  // neighbours are cut from the same chunks
  std::iota(by_place.begin(), by_place.end(), std::size_t{0});
  std::sort(by_place.begin(), by_place.end(),
            [&](std::size_t a, std::size_t b) { return placed[a].id < placed[b].id; });
  tbb::parallel_for(std::size_t{0}, placed.size(), [&](std::size_t n) {
    const std::size_t k = by_place[n];
    const Blend::Placed& p = placed[k];
    const auto surface = db.surface(p.id);
    Blocks& blocks = highest_[k];
    top[k] = kNothing;
    for (int j = 0; j < kBlocks; ++j)
      for (int i = 0; i < kBlocks; ++i) {
        const int i0 = 1 + i * kCells, j0 = 1 + j * kCells;
        const int i1 = std::min(i0 + kCells, kSide - 2), j1 = std::min(j0 + kCells, kSide - 2);
        const bool apart = i0 > p.domain.i1 || j0 > p.domain.j1;
        const double sign = p.quantum < 0 ? -1 : 1;  // depths: the least of them is the highest place
        const double code =
            apart ? -INFINITY : sign * most_of(surface->codes.data(), sign, i0, j0, i1, j1, smoothness);
        float& h = blocks[std::size_t(j * kBlocks + i)];
        h = apart ? kNothing : float_at_least(p.quantum * (p.origin + code) + p.base);
        // The evaluator rounds elsewhere: a hair more.
        if (!apart) h = float_at_least(double(h) + 1e-6 + 1e-9 * std::abs(double(h)));
        top[k] = std::max(top[k], h);
      }
  });
  for (const float h : top) lowest_ = std::min(lowest_, double(h));
  std::vector<LodEntry> entries;
  entries.reserve(placed.size());
  for (std::size_t k = 0; k < placed.size(); ++k) {
    const Extent& e = placed[k].bounds;
    entries.push_back({{e.xmin, e.ymin, e.xmax, e.ymax, 0, float_at_least(double(top[k]) - lowest_)}, {k}});
  }
  tree_ = LodTree::build(std::move(entries));
}

}  // namespace patchwork
