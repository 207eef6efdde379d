// The only file that includes CGAL. Number type: rationals in lowest terms, so the vertices of repeated
// splits, each the meeting of two given lines, stay as short as if they had been computed from those lines at
// once.
#include "db/coverage_exact.h"

#include <CGAL/Exact_rational.h>

#include "db/coverage_split.h"

namespace patchwork::coverage {

namespace {

using Number = CGAL::Exact_rational;

struct ExactPolygon : std::vector<Vertex<Number>> {
  bool full() const { return false; }
};

struct ExactFrame {
  Number x0, xi, xj, y0, yi, yj;
  explicit ExactFrame(const Frame& f) {
    const std::array<double, 6>& n = f.numbers();
    x0 = Number(n[0]), xi = Number(n[1]), xj = Number(n[2]);
    y0 = Number(n[3]), yi = Number(n[4]), yj = Number(n[5]);
  }
  Number det() const { return xi * yj - xj * yi; }
};

Number absolute(const Number& x) { return x < 0 ? Number(-x) : x; }

// |a u + b v + c| <= h as two half planes.
void add_strip(Edges<Number>& e, const Number& a, const Number& b, const Number& c, const Number& h) {
  e.add({a, b, h + c});
  e.add({-a, -b, h - c});
}

// The cover's edges in the target's lattice coordinates. In the cover's lattice they are |i - ki| <= hi, |j -
// kj| <= hj; both sides are multiplied by the determinant of its frame, which saves the inverse and makes
// mirrored frames alike.
Edges<Number> edges(const ExactFrame& t, const OrientedRect& cover) {
  const ExactFrame q(*cover.frame);
  const Number i0(cover.rect.i0), i1(cover.rect.i1), j0(cover.rect.j0), j1(cover.rect.j1);
  const Number ki = (i0 + i1) / 2, kj = (j0 + j1) / 2, det = absolute(q.det());
  const Number x = t.x0 - q.x0 - q.xi * ki - q.xj * kj, y = t.y0 - q.y0 - q.yi * ki - q.yj * kj;
  Edges<Number> e;
  add_strip(e, q.yj * t.xi - q.xj * t.yi, q.yj * t.xj - q.xj * t.yj, q.yj * x - q.xj * y,
            det * (i1 - i0) / 2);
  add_strip(e, q.xi * t.yi - q.yi * t.xi, q.xi * t.yj - q.yi * t.xj, q.xi * y - q.yi * x,
            det * (j1 - j0) / 2);
  return e;
}

ExactPolygon polygon(const LatticeRect& r) {
  const Number i0(r.i0), i1(r.i1), j0(r.j0), j1(r.j1);
  ExactPolygon p;
  p.push_back({i0, j0}), p.push_back({i1, j0}), p.push_back({i1, j1}), p.push_back({i0, j1});
  return p;
}

Number area(const OrientedRect& r) {
  const Number w = Number(r.rect.i1) - Number(r.rect.i0), h = Number(r.rect.j1) - Number(r.rect.j0);
  return absolute(ExactFrame(*r.frame).det()) * w * h;
}

}  // namespace

bool covered_exact(const OrientedRect& target, std::span<const OrientedRect> covers) {
  if (target.rect.empty()) return true;
  const ExactFrame t(*target.frame);
  std::vector<Edges<Number>> all;
  for (const OrientedRect& c : covers)
    if (!c.rect.empty()) all.push_back(edges(t, c));
  std::vector<Piece<ExactPolygon>> work{{polygon(target.rect), 0}};
  return !subtract(work, all, [](const ExactPolygon&) { return true; });
}

int compare_areas_exact(const OrientedRect& a, const OrientedRect& b) {
  const Number x = area(a), y = area(b);
  return x < y ? -1 : x > y ? 1 : 0;
}

}  // namespace patchwork::coverage
