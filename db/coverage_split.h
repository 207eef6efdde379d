// Taking rectangles away from convex pieces, over any number type (internal to coverage; design: model,
// section 3).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "db/frame.h"

namespace patchwork::coverage {

template <class T>
struct Vertex {
  T u, v;
};

/// The half plane a u + b v + c >= 0.
template <class T>
struct HalfPlane {
  T a, b, c;
  T at(const Vertex<T>& p) const { return a * p.u + b * p.v + c; }
};

/// A rectangle as the half planes of its edges; edges that no piece can reach may be left out.
template <class T>
struct Edges {
  std::array<HalfPlane<T>, 4> side;
  int count = 0;
  void add(const HalfPlane<T>& h) { side[count++] = h; }
  const HalfPlane<T>* begin() const { return side.data(); }
  const HalfPlane<T>* end() const { return side.data() + count; }
};

/// A piece of the target that none of the covers before `next` has touched or taken.
template <class Shape>
struct Piece {
  Shape shape;
  std::size_t next = 0;
};

/// Takes `cover` away from `piece`: pushes what is left of it and returns true, or returns false if they do
/// not meet (in more than an edge).
inline bool cut(const LatticeRect& piece, const LatticeRect& cover, std::size_t next,
                std::vector<Piece<LatticeRect>>& work) {
  const double i0 = std::max(piece.i0, cover.i0), i1 = std::min(piece.i1, cover.i1);
  const double j0 = std::max(piece.j0, cover.j0), j1 = std::min(piece.j1, cover.j1);
  if (LatticeRect{i0, j0, i1, j1}.empty()) return false;
  const auto keep = [&](const LatticeRect& r) {
    if (!r.empty()) work.push_back({r, next});
  };
  keep({piece.i0, piece.j0, i0, piece.j1});
  keep({i1, piece.j0, piece.i1, piece.j1});
  keep({i0, piece.j0, i1, j0});
  keep({i0, j1, i1, piece.j1});
  return true;
}

/// Whether a polygon has vertices strictly inside and strictly outside a half plane.
struct Sides {
  bool in = false, out = false;
};

template <class Polygon, class T>
Sides sides(const Polygon& p, const HalfPlane<T>& h) {
  Sides s;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const T d = h.at(p[i]);
    s.in |= d > 0;
    s.out |= d < 0;
  }
  return s;
}

/// The point where the segment from `a` (value da) to `b` (value db, of the other sign) meets the line.
template <class T>
Vertex<T> crossing(const Vertex<T>& a, const T& da, const Vertex<T>& b, const T& db) {
  const T t = da / (da - db);
  return {a.u + t * (b.u - a.u), a.v + t * (b.v - a.v)};
}

/// Splits `p` along the edge of `h`. Both parts get the same two new vertices, so no point falls between
/// them.
template <class Polygon, class T>
void split(const Polygon& p, const HalfPlane<T>& h, Polygon& in, Polygon& out) {
  in.clear(), out.clear();
  Vertex<T> a = p[p.size() - 1];
  T da = h.at(a);
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vertex<T>& b = p[i];
    const T db = h.at(b);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
      const Vertex<T> x = crossing(a, da, b, db);
      in.push_back(x), out.push_back(x);
    }
    if (db >= 0) in.push_back(b);
    if (db <= 0) out.push_back(b);
    a = b, da = db;
  }
}

/// The same for convex polygons (size, [], push_back, clear, full). Where the cover turns out to miss the
/// piece, the piece stays whole. A polygon that is full stays whole too, which the filter takes as "not
/// decided".
template <class Polygon, class T>
bool cut(const Polygon& piece, const Edges<T>& cover, std::size_t next, std::vector<Piece<Polygon>>& work) {
  for (const HalfPlane<T>& h : cover)
    if (!sides(piece, h).in) return false;
  const std::size_t before = work.size();
  Polygon inside = piece, part;
  for (const HalfPlane<T>& h : cover) {
    const Sides s = sides(inside, h);
    if (!s.in || inside.full()) {
      work.erase(work.begin() + static_cast<std::ptrdiff_t>(before), work.end());
      return false;
    }
    if (!s.out) continue;
    work.emplace_back();
    work.back().next = next;
    split(inside, h, part, work.back().shape);
    std::swap(inside, part);
  }
  return true;
}

/// Takes all covers away from the pieces in `work`, depth first, and calls `left` with each piece that no
/// cover takes. Stops and returns true as soon as `left` does.
template <class Shape, class Cover, class Left>
bool subtract(std::vector<Piece<Shape>>& work, const std::vector<Cover>& covers, const Left& left) {
  while (!work.empty()) {
    const Piece<Shape> piece = std::move(work.back());
    work.pop_back();
    std::size_t k = piece.next;
    while (k < covers.size() && !cut(piece.shape, covers[k], k + 1, work)) ++k;
    if (k == covers.size() && left(piece.shape)) return true;
  }
  return false;
}

}  // namespace patchwork::coverage
