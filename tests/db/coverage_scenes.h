// Rectangles, scenes and a brute-force reference for the tests of coverage.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <random>
#include <vector>

#include "db/coverage.h"

namespace patchwork::coverage_test {

constexpr double kGrowth = 1.0 / 1024;
constexpr double kFar = 1e7;
constexpr double kAngles[] = {0, 1e-9, 1e-5, 0.3, 0.7853981633974483, 1.1, 3.0};
constexpr double kOrigins[] = {0, 512345.678, kFar + 0.123};

inline std::mt19937_64 seeded() {
  const char* given = std::getenv("PATCHWORK_SEED");
  const std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : std::random_device{}();
  std::cout << "PATCHWORK_SEED=" << seed << '\n';
  return std::mt19937_64(seed);
}

inline double uniform(std::mt19937_64& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

inline Frame frame(double angle, double si, double sj, double x0, double y0) {
  const double c = std::cos(angle), s = std::sin(angle);
  return Frame::from_trusted({x0, si * c, -sj * s, y0, si * s, sj * c});
}

inline LatticeRect grown(const LatticeRect& r, double by = kGrowth) {
  return {r.i0 - by, r.j0 - by, r.i1 + by, r.j1 + by};
}

// Other numbers for the same lattice, without rounding: the i axis reversed, or both steps doubled.
inline Frame reversed(const Frame& f) {
  const auto& n = f.numbers();
  return Frame::from_trusted({n[0], -n[1], n[2], n[3], -n[4], n[5]});
}
inline Frame doubled(const Frame& f) {
  const auto& n = f.numbers();
  return Frame::from_trusted({n[0], 2 * n[1], 2 * n[2], n[3], 2 * n[4], 2 * n[5]});
}
inline LatticeRect reversed(const LatticeRect& r) { return {-r.i1, r.j0, -r.i0, r.j1}; }
inline LatticeRect doubled(const LatticeRect& r) { return {r.i0 / 2, r.j0 / 2, r.i1 / 2, r.j1 / 2}; }

// The predicate, with the law of the counts checked on every call.
inline bool ask(const OrientedRect& target, const std::vector<OrientedRect>& covers,
                CoverageCounts* counts = nullptr) {
  CoverageCounts c;
  const bool answer = covered(target, covers, c);
  EXPECT_EQ(c.integer + c.interval + c.exact, 1u);
  if (counts) *counts += c;
  return answer;
}

inline std::vector<OrientedRect> placed(const Frame& f, const std::vector<LatticeRect>& rects) {
  std::vector<OrientedRect> out;
  for (const LatticeRect& r : rects) out.push_back({&f, r});
  return out;
}

inline std::array<Point, 4> corners(const OrientedRect& r) {
  const Frame& f = *r.frame;
  return {f.to_domain(r.rect.i0, r.rect.j0), f.to_domain(r.rect.i1, r.rect.j0),
          f.to_domain(r.rect.i1, r.rect.j1), f.to_domain(r.rect.i0, r.rect.j1)};
}

inline bool contains(const OrientedRect& r, Point p) {
  const Point l = r.frame->to_lattice(p.x, p.y);
  return l.x >= r.rect.i0 && l.x <= r.rect.i1 && l.y >= r.rect.j0 && l.y <= r.rect.j1;
}

inline bool in_any(const std::vector<OrientedRect>& covers, Point p) {
  return std::any_of(covers.begin(), covers.end(), [&](const OrientedRect& c) { return contains(c, p); });
}

// Naive: every corner of the target lies in some cover, in double.
inline bool corners_covered(const OrientedRect& target, const std::vector<OrientedRect>& covers) {
  const auto all = corners(target);
  return std::all_of(all.begin(), all.end(), [&](Point p) { return in_any(covers, p); });
}

// --- Brute force: whatever is uncovered has a vertex where two edges meet; look a hair away from it to all
// sides.

inline void points_at(const std::array<Point, 2>& a, const std::array<Point, 2>& b, double hair,
                      std::vector<Point>& out) {
  const double ax = a[1].x - a[0].x, ay = a[1].y - a[0].y, bx = b[1].x - b[0].x, by = b[1].y - b[0].y;
  const double det = ax * by - ay * bx, la = std::hypot(ax, ay), lb = std::hypot(bx, by);
  if (std::abs(det) < 1e-12 * la * lb) return;
  const double t = ((b[0].x - a[0].x) * by - (b[0].y - a[0].y) * bx) / det;
  const double x = a[0].x + t * ax, y = a[0].y + t * ay;
  for (const double s : {-hair, hair})
    for (const double r : {-hair, hair})
      out.push_back({x + s * ax / la + r * bx / lb, y + s * ay / la + r * by / lb});
}

inline bool covered_by_looking(const OrientedRect& target, const std::vector<OrientedRect>& covers,
                               double hair) {
  std::vector<std::array<Point, 2>> edges;
  const auto add = [&](const OrientedRect& r) {
    const auto c = corners(r);
    for (std::size_t k = 0; k < 4; ++k) edges.push_back({c[k], c[(k + 1) % 4]});
  };
  add(target);
  for (const OrientedRect& c : covers) add(c);
  std::vector<Point> points;
  for (std::size_t a = 0; a < edges.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) points_at(edges[a], edges[b], hair, points);
  return std::all_of(points.begin(), points.end(),
                     [&](Point p) { return !contains(target, p) || in_any(covers, p); });
}

// --- Random scenes.

struct Scene {
  std::deque<Frame> frames;
  OrientedRect target;
  std::vector<OrientedRect> covers;
};

// A target of 28 x 28 cells and up to 12 covers of other steps and angles, some mirrored, some in its own
// frame.
inline Scene random_scene(std::mt19937_64& rng, double origin) {
  Scene s;
  const double step = std::exp(uniform(rng, -4, 4));
  s.frames.push_back(frame(uniform(rng, -4, 4), step, step * uniform(rng, 0.5, 2), origin, origin / 2));
  const Frame& own = s.frames.back();
  s.target = {&own, {28, -56, 56, -28}};
  const Point middle = own.to_domain(42, -42);
  for (int n = 1 + static_cast<int>(rng() % 12); n > 0; --n) {
    if (rng() % 6 == 0) {
      const double i = 7.0 * static_cast<double>(rng() % 7), j = 7.0 * static_cast<double>(rng() % 7) - 70;
      s.covers.push_back({&own, grown({i, j, i + 21, j + 28})});
      continue;
    }
    const double cell = step * uniform(rng, 0.2, 3), mirror = rng() % 2 ? 1 : -1;
    s.frames.push_back(frame(uniform(rng, -4, 4), cell * mirror, cell,
                             middle.x + step * uniform(rng, -15, 15),
                             middle.y + step * uniform(rng, -15, 15)));
    const double w = std::round(step / cell * uniform(rng, 6, 24)) + 1,
                 h = std::round(step / cell * uniform(rng, 6, 24)) + 1;
    s.covers.push_back({&s.frames.back(), grown({-w, -h, w, h})});
  }
  return s;
}

// The target cut at a random cross into four covers, in the target's own numbers or another lattice's, each
// moved outward or inward by nothing, an ulp-scale step or the growth: the answer hangs on edges that
// coincide.
inline Scene tight_scene(std::mt19937_64& rng, double origin) {
  Scene s;
  s.frames.push_back(frame(uniform(rng, -4, 4), 10, 7, origin, -origin));
  s.frames.push_back(reversed(s.frames[0]));
  s.frames.push_back(doubled(s.frames[0]));
  s.target = {&s.frames[0], {28, -56, 56, -28}};
  const double i = 28 + static_cast<double>(rng() % 28), j = -56 + static_cast<double>(rng() % 28);
  const double by[] = {0, 0, 0, 0x1p-44, kGrowth, -0x1p-44};
  for (const LatticeRect& r : {LatticeRect{28, -56, i, j}, LatticeRect{i, -56, 56, j},
                               LatticeRect{28, j, i, -28}, LatticeRect{i, j, 56, -28}}) {
    const LatticeRect g = r.empty() ? r : grown(r, by[rng() % 6]);
    const std::size_t f = rng() % 3;
    s.covers.push_back({&s.frames[f], f == 0 ? g : f == 1 ? reversed(g) : doubled(g)});
  }
  return s;
}

}  // namespace patchwork::coverage_test
