#include "render/effects/relief.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "render/effects/glsl.h"

namespace patchwork::effects {

Relief::Relief(Point first, double step, int width, int height, std::vector<float> heights)
    : first_(first), step_(step), width_(width), height_(height), levels_(std::move(heights)) {
  assert(width >= 2 && height >= 2 && levels_.size() == std::size_t(width) * std::size_t(height));
  for (float& h : levels_)
    if (!std::isfinite(h)) h = kLow;
  const auto blocks = [&](int side, int level) { return ((side - 2) >> level) + 1; };
  for (int level = 0;; ++level) {
    const int across = blocks(width, level), down = blocks(height, level);
    starts_.push_back(levels_.size());
    for (int j = 0; j < down; ++j)
      for (int i = 0; i < across; ++i) {
        float most = kLow;
        for (int k = 0; k < 4; ++k) {
          const int a = (level == 0 ? i : 2 * i) + k % 2, b = (level == 0 ? j : 2 * j) + k / 2;
          if (level == 0)
            most = std::max(most, levels_[std::size_t(b) * std::size_t(width) + std::size_t(a)]);
          else if (a < blocks(width, level - 1) && b < blocks(height, level - 1))
            most = std::max(most, largest(level - 1, a, b));
        }
        levels_.push_back(most);
      }
    if (across == 1 && down == 1) break;
  }
}

ReliefShape ReliefShape::over(const Extent& e, int most) {
  const double step = std::max(e.xmax - e.xmin, e.ymax - e.ymin) / (most - 1);
  const int width = std::max(2, int(std::ceil((e.xmax - e.xmin) / step - 1e-9)) + 1);
  const int height = std::max(2, int(std::ceil((e.ymax - e.ymin) / step - 1e-9)) + 1);
  return {{e.xmin, e.ymin}, step, width, height};
}

Relief Relief::of(const Evaluator& surface, const Extent& e, int most) {
  const ReliefShape s = ReliefShape::over(e, most);
  std::vector<double> z(std::size_t(s.width) * std::size_t(s.height));
  surface.at_pixels({e.xmin, s.step, 0, e.ymin, 0, s.step}, s.width, 0, s.height, {z, {}, {}, {}});
  return Relief(s, std::vector<float>(z.begin(), z.end()));
}

double Relief::range() const {
  float lowest = INFINITY, highest = -INFINITY;
  for (std::size_t k = 0; k < start(0); ++k)
    if (levels_[k] != kLow) lowest = std::min(lowest, levels_[k]), highest = std::max(highest, levels_[k]);
  return lowest <= highest ? double(highest) - double(lowest) : 0;
}

namespace {

using namespace glsl;

// horizon.glsl's functions become members, which find height_at and pyramid_max beside them.
struct March {
  const Relief& relief;
  int width, height, top;
  double height_at(int i, int j) const {
    return double(relief.heights()[std::size_t(j) * std::size_t(width) + std::size_t(i)]);
  }
  double pyramid_max(int level, int i, int j) const { return double(relief.largest(level, i, j)); }

#define float double
#include "render/effects/horizon.glsl"
#undef float
};

}  // namespace

double Relief::horizon(double i, double j, double azimuth) const {
  March march{*this, width_, height_, top()};
  const int ci = std::clamp(int(i), 0, width_ - 2), cj = std::clamp(int(j), 0, height_ - 2);
  const double x = i - ci, y = j - cj;
  const double z = (1 - y) * ((1 - x) * march.height_at(ci, cj) + x * march.height_at(ci + 1, cj)) +
                   y * ((1 - x) * march.height_at(ci, cj + 1) + x * march.height_at(ci + 1, cj + 1));
  const vec2 direction(std::sin(azimuth), std::cos(azimuth));
  return march.horizon({i, j}, direction, z, kFirst, 1e30) / step_;
}

namespace {

// Of a square of cells, metres and samples.
struct Square {
  float lowest = INFINITY, highest = -INFINITY;
  float slope = 0;  // the largest gradient of its cells, metres a sample
  bool holes = false;
};

// What a place of `from` may see of the squares around it: no place rises faster than the ground does on the
// way to it, unless a hole lies there.
float tangent_nearby(const Square& from, const Square& near) {
  if (!from.holes && !near.holes) return near.slope;
  return std::max(near.slope, (near.highest - from.lowest) / float(Relief::kFirst));
}

// Between places of two squares, samples.
struct Distance {
  float least, most;
  Distance(int di, int dj, int side)
      : least(std::hypot(float(std::max(0, di - 1) * side), float(std::max(0, dj - 1) * side))),
        most(std::hypot(float((di + 1) * side), float((dj + 1) * side))) {}
};

// The tangent under which `seen` is seen from `from` at the most.
float tangent(const Square& from, const Square& seen, const Distance& d) {
  const float rise = seen.highest - from.lowest;
  return rise / (rise > 0 ? d.least : d.most);
}

}  // namespace

// Squares that are no neighbours are seen under their highest point from the lowest.
std::vector<float> Relief::steepest(int side) const {
  const int across = (width_ - 2) / side + 1, down = (height_ - 2) / side + 1;
  std::vector<Square> squares(std::size_t(across) * std::size_t(down));
  const auto square = [&](int i, int j) -> Square& {
    return squares[std::size_t(j) * std::size_t(across) + std::size_t(i)];
  };
  for (int j = 0; j + 1 < height_; ++j)
    for (int i = 0; i + 1 < width_; ++i) {
      const float* h = &levels_[std::size_t(j) * std::size_t(width_) + std::size_t(i)];
      const float a = h[0], b = h[1], c = h[width_], d = h[width_ + 1];
      Square& s = square(i / side, j / side);
      for (const float z : {a, b, c, d}) {
        if (z == kLow) s.holes = true;
        if (z != kLow) s.lowest = std::min(s.lowest, z), s.highest = std::max(s.highest, z);
      }
      if (std::min({a, b, c, d}) == kLow) continue;
      s.slope = std::max(s.slope, std::hypot(std::max(std::abs(b - a), std::abs(d - c)),
                                             std::max(std::abs(c - a), std::abs(d - b))));
    }
  std::vector<Distance> distances;  // by how many squares lie between them, across and down
  for (int j = 0; j < down; ++j)
    for (int i = 0; i < across; ++i) distances.emplace_back(i, j, side);
  std::vector<float> most(squares.size());
  for (int j = 0; j < down; ++j)
    for (int i = 0; i < across; ++i) {
      float& m = most[std::size_t(j) * std::size_t(across) + std::size_t(i)];
      const Square& from = square(i, j);
      if (!(from.lowest <= from.highest)) continue;  // no data
      for (int q = 0; q < down; ++q)
        for (int p = 0; p < across; ++p) {
          const bool near = std::abs(p - i) <= 1 && std::abs(q - j) <= 1;
          const auto apart =
              std::size_t(std::abs(q - j)) * std::size_t(across) + std::size_t(std::abs(p - i));
          m = std::max(
              m, near ? tangent_nearby(from, square(p, q)) : tangent(from, square(p, q), distances[apart]));
        }
      m /= float(step_);
    }
  return most;
}

}  // namespace patchwork::effects
