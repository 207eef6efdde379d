#include "blend/vulkan/tile_binning.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace patchwork {

namespace {

constexpr double kMiddle = 0.5 * (PatchSurface::kSide - 1);
constexpr double kWholePart = 1024;   // whole parts are multiples of 1 / this
constexpr double kLargest = 1 << 13;  // beyond it a coordinate is outside every window, to any precision

// Exactly as Blend places a pixel.
Point vertex(const RasterFrame& f, double c, double r) {
  return {f.x0 + (f.xc * c + f.xr * r), f.y0 + (f.yc * c + f.yr * r)};
}

// What the whole part leaves is below 2^-11 where it matters, and rounds at 2^-36.
void split(double value, float& whole, float& rest) {
  whole = float(std::abs(value) < kLargest ? std::nearbyint(value * kWholePart) / kWholePart : value);
  rest = float(value - double(whole));
}

// Tiles are halved, and the patches with them, until one is left: few tiles look at few patches.
class Binner {
 public:
  Binner(const std::vector<Blend::Placed>& placed, const RasterFrame& lattice, std::span<const Tile> tiles,
         bool priority)
      : placed_(placed), lattice_(lattice), tiles_(tiles), priority_(priority), found(tiles.size()) {}

  void halve(std::span<std::uint32_t> some, const Candidates& from) {
    Corners corners;
    const bool wide = corners_of(some, corners);
    bool inside = false;
    Candidates candidates = filter(placed_, from, corners, priority_, inside);
    if (some.size() == 1) {
      found[some[0]] = std::move(candidates);
      return;
    }
    const auto middle = some.begin() + std::ptrdiff_t(some.size() / 2);
    std::nth_element(some.begin(), middle, some.end(), [&](std::uint32_t a, std::uint32_t b) {
      return wide ? tiles_[a].c0 < tiles_[b].c0 : tiles_[a].r0 < tiles_[b].r0;
    });
    halve(some.first(some.size() / 2), candidates);
    halve(some.subspan(some.size() / 2), candidates);
  }

 private:
  // True if the quadrangle's longer side lies along the lattice's columns.
  bool corners_of(std::span<const std::uint32_t> some, Corners& corners) const {
    double c0 = INFINITY, r0 = INFINITY, c1 = -INFINITY, r1 = -INFINITY;
    for (const std::uint32_t k : some) {
      const Tile& t = tiles_[k];
      c0 = std::min(c0, double(t.c0)), c1 = std::max(c1, t.c0 + double(t.stride) * (t.across - 1));
      r0 = std::min(r0, double(t.r0)), r1 = std::max(r1, t.r0 + double(t.stride) * (t.down - 1));
    }
    corners[0] = vertex(lattice_, c0, r0), corners[1] = vertex(lattice_, c1, r0);
    corners[2] = vertex(lattice_, c1, r1), corners[3] = vertex(lattice_, c0, r1);
    return c1 - c0 > r1 - r0;
  }

  const std::vector<Blend::Placed>& placed_;
  const RasterFrame& lattice_;
  std::span<const Tile> tiles_;
  bool priority_;

 public:
  std::vector<Candidates> found;
};

}  // namespace

TileEntry make_entry(const Blend::Placed& p, SlotOf slot, const RasterFrame& f, const Tile& tile,
                     double base) {
  const double uc = (p.ua * f.xc + p.ub * f.yc) * tile.stride, ur = (p.ua * f.xr + p.ub * f.yr) * tile.stride;
  const double vc = (p.va * f.xc + p.vb * f.yc) * tile.stride, vr = (p.va * f.xr + p.vb * f.yr) * tile.stride;
  const auto window = [&](double c, double r) -> Point {
    const Point at = vertex(f, tile.c0 + tile.stride * c, tile.r0 + tile.stride * r);
    const double dx = at.x - p.x0, dy = at.y - p.y0;
    return {(p.ua * dx + p.ub * dy) - p.first_i, (p.va * dx + p.vb * dy) - p.first_j};
  };
  const Point first = window(0, 0);
  const double du = kMiddle - first.x, dv = kMiddle - first.y, area = uc * vr - ur * vc;
  const auto nearest = [&](double at, int n) {
    return std::isfinite(at) ? std::clamp(std::nearbyint(at), 0.0, double(n - 1)) : 0.0;
  };
  const double c = nearest((vr * du - ur * dv) / area, tile.across);
  const double r = nearest((uc * dv - vc * du) / area, tile.down);
  const Point anchor = window(c, r);
  TileEntry e{};
  split(anchor.x, e.whole_u[0], e.rest_u[0]), split(anchor.y, e.whole_v[0], e.rest_v[0]);
  split(uc, e.whole_u[1], e.rest_u[1]), split(ur, e.whole_u[2], e.rest_u[2]);
  split(vc, e.whole_v[1], e.rest_v[1]), split(vr, e.whole_v[2], e.rest_v[2]);
  e.anchor_c = float(c), e.anchor_r = float(r);
  e.slot = float(slot.slot), e.height = float(slot.height - base);
  e.quantum = float(p.quantum), e.origin = slot.origin, e.error = float(p.error);
  e.grid = float(p.id.grid().value + 1);
  return e;
}

std::vector<Candidates> choose_patches(const std::vector<Blend::Placed>& placed, const RasterFrame& lattice,
                                       std::span<const Tile> tiles, bool priority) {
  Binner binner(placed, lattice, tiles, priority);
  if (tiles.empty()) return {};
  Candidates all(placed.size());
  std::iota(all.begin(), all.end(), 0u);
  std::vector<std::uint32_t> order(tiles.size());
  std::iota(order.begin(), order.end(), 0u);
  binner.halve(order, all);
  return std::move(binner.found);
}

TileBins bin_tiles(const std::vector<Blend::Placed>& placed, std::span<const SlotOf> slots,
                   const RasterFrame& lattice, std::span<const Tile> tiles,
                   std::span<const Candidates> chosen, std::uint32_t blocks, double base) {
  TileBins bins;
  bins.tiles.reserve(tiles.size());
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    bins.tiles.push_back({std::uint32_t(bins.entries.size()), std::uint32_t(chosen[t].size()),
                          std::uint32_t(bins.lists), tiles[t]});
    for (const std::uint32_t k : chosen[t])
      bins.entries.push_back(make_entry(placed[k], slots[k], lattice, tiles[t], base));
    bins.lists += std::uint64_t{blocks} * (chosen[t].size() + 1);
  }
  return bins;
}

}  // namespace patchwork
