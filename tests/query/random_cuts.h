// Cuts of every kind over a square around the origin, at random.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>

#include "query/cut.h"

namespace patchwork {

class Random {
 public:
  explicit Random(std::uint64_t seed) : random_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  std::size_t below(std::size_t n) { return random_() % n; }

  ViewCut view(double side) {
    ViewCut v{.eye = {uniform(-side, side), uniform(-side, side), uniform(10, side)}, .look = {}};
    v.look = {uniform(-side, side), uniform(-side, side), uniform(-100, 300)};
    if (below(8) == 0) v.look = {v.eye.x, v.eye.y, v.eye.z - 100};  // straight down
    v.fov_degrees = uniform(10, 100), v.pixel_error = std::exp2(uniform(-1, 4)),
    v.far = uniform(100, 4 * side);
    v.lowest = -60, v.highest = 250;
    v.in_space = below(2) == 0;
    return v;
  }
  FieldCut field(double side) {
    const double angle = uniform(0, 7), step = uniform(0.002, 0.03) * side;
    FieldCut f{
        .frame = Frame::from_trusted({uniform(-side, side), step * std::cos(angle), -step * std::sin(angle),
                                      uniform(-side, side), step * std::sin(angle), step * std::cos(angle)}),
        .width = 1 + int(below(90)),
        .height = 1 + int(below(90)),
        .tolerance = {},
        .outside = uniform(0, 50)};
    for (int k = 0; k < f.width * f.height; ++k)
      f.tolerance.push_back(below(9) == 0 ? NAN : float(std::exp2(uniform(-3, 6))));
    return f;
  }
  CorridorCut corridor(double side) {
    CorridorCut c;
    for (int k = 0; k < 4; ++k) c.line.push_back({uniform(-side, side), uniform(-side, side)});
    c.error = uniform(0, 2), c.outside = uniform(2, 100), c.width = uniform(0, 100), c.ramp = uniform(0, 300);
    return c;
  }
  UniformCut uniform_cut(double side) {
    const double x = uniform(-side, side), y = uniform(-side, side), a = uniform(1, side);
    return {.error = std::exp2(uniform(-4, 7)), .region = Region::inside(Extent{x, y, x + a, y + a})};
  }

 private:
  std::mt19937_64 random_;
};

/// Axes whose angle has this cosine.
inline Frame sheared(Random& random, double cosine) {
  const double angle = random.uniform(0, 7), other = angle + std::acos(cosine), i = random.uniform(1, 20),
               j = random.uniform(1, 20);
  return Frame::from_trusted({random.uniform(-2000, 2000), i * std::cos(angle), j * std::cos(other),
                              random.uniform(-2000, 2000), i * std::sin(angle), j * std::sin(other)});
}

/// `kind`: 0 uniform, 1 view, 2 corridor, 3 field.
inline std::unique_ptr<CutSurface> any_cut(Random& random, double side, int kind) {
  if (kind == 0) return make_surface(random.uniform_cut(side));
  if (kind == 1) return make_surface(random.view(side));
  return kind == 3 ? make_surface(random.field(side)) : make_surface(random.corridor(side));
}

}  // namespace patchwork
