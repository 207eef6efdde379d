#include "db/coverage.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "db/coverage_exact.h"
#include "db/coverage_split.h"

namespace patchwork {

namespace {

using coverage::Edges;
using coverage::Piece;
using coverage::Vertex;

// The interval filter works in the target's lattice, measured from the target's centre, so that its numbers
// stay small at coordinates of 1e7 m. A cover is two strips |a u + b v + c| <= h (both sides times the
// determinant of its frame: no division). tau bounds every error of a strip over the target's box |u| <= w,
// |v| <= h, with U = 2^-53 and m the sum of the magnitudes of all terms:
// - c is a chain of at most 10 roundings; a, b, h and the determinant have 2 to 4: 14 U m;
// - box and strip are measured from rounded centres, the box is rounded up: 12 U m;
// - one evaluation of a strip: 4 U m; a crossing found from two evaluated ends: 4 U m. In all 34, taken
// is 48.
// - A crossing lies on its segment up to 6 U w, 6 U h. Each of at most 4 splits a cover moves an outline so
//   much, once for the vertices, once for the points between the parts: 12 U (|a| w + |b| h), taken is 16.
// So, if all pieces vanish with covers shrunk by tau, every point of the target lies in a true cover; and
// what is outside a strip by more than tau is outside the true cover. Underflow adds less than U m if m >
// 1e-250.
constexpr double kUnit = 0x1p-53;
constexpr double kPerMagnitude = 48, kPerSplit = 16;
constexpr double kTiny = 1e-250, kHuge = 1e250;

struct Strip {
  double a, b, c, h;
  double tau;  // see above; infinite if nothing is known
  double at(double u, double v) const { return a * u + b * v + c; }
  bool outside(double u, double v) const { return std::abs(at(u, v)) > h + tau; }
};

// A cover that the filter could neither prove to contain the target nor to miss it.
struct Near {
  std::array<Strip, 2> strip;
  bool outside(double u, double v) const { return strip[0].outside(u, v) || strip[1].outside(u, v); }
};

// A convex polygon of doubles that never touches the heap.
class SmallPolygon {
 public:
  std::size_t size() const { return size_; }
  const Vertex<double>& operator[](std::size_t i) const { return vertex_[i]; }
  void clear() { size_ = 0; }
  void push_back(const Vertex<double>& p) {
    assert(size_ < kMax);
    vertex_[size_++] = p;
  }
  // True if a split might not fit: it makes at most 3/2 n vertices of n, even where rounding bends the
  // outline.
  bool full() const { return 3 * size_ > 2 * kMax; }

 private:
  static constexpr std::size_t kMax = 16;
  std::size_t size_ = 0;
  std::array<Vertex<double>, kMax> vertex_;
};

// Vectors that keep their memory from call to call: no allocation in the common path.
struct Scratch {
  std::vector<LatticeRect> own;  // covers in the target's frame that meet it
  std::vector<const OrientedRect*> foreign;
  std::vector<OrientedRect> rest;    // all covers that may matter
  std::vector<Near> near;            // the same as strips
  std::vector<Edges<double>> edges;  // the same, shrunk by tau
  std::vector<Piece<LatticeRect>> rects;
  std::vector<Piece<SmallPolygon>> polygons;
  void clear() { own.clear(), foreign.clear(), rest.clear(), near.clear(), edges.clear(); }
};

bool same_frame(const OrientedRect& a, const OrientedRect& b) {
  return a.frame == b.frame || a.frame->numbers() == b.frame->numbers();
}

bool contains(const LatticeRect& outer, const LatticeRect& inner) {
  return outer.i0 <= inner.i0 && outer.i1 >= inner.i1 && outer.j0 <= inner.j0 && outer.j1 >= inner.j1;
}

bool overlap(const LatticeRect& a, const LatticeRect& b) {
  return a.i0 < b.i1 && b.i0 < a.i1 && a.j0 < b.j1 && b.j0 < a.j1;
}

// Lattice coordinates are compared, never computed with: exact.
bool covered_by_own(const LatticeRect& target, Scratch& s) {
  s.rects.assign(1, {target, 0});
  return !subtract(s.rects, s.own, [](const LatticeRect&) { return true; });
}

// The target seen from its centre.
struct Box {
  LatticeRect rect;
  double ci, cj;
  double w, h;    // half sizes, rounded up
  double splits;  // kPerSplit times the most splits that a piece can see

  Box(const LatticeRect& r, std::size_t covers) : rect(r), ci(0.5 * (r.i0 + r.i1)), cj(0.5 * (r.j0 + r.j1)) {
    const double wi = 0.5 * (r.i1 - r.i0), hj = 0.5 * (r.j1 - r.j0);
    const double ei = 4 * kUnit * (std::abs(ci) + wi), ej = 4 * kUnit * (std::abs(cj) + hj);
    w = wi + ei, h = hj + ej;
    splits = kPerSplit * 4 * static_cast<double>(covers);
  }

  // The allowance of a strip with magnitude m and reach r (the reach is added to m).
  double tau(double m, double r) const {
    m += r;
    return m > kTiny && m < kHuge ? kUnit * (kPerMagnitude * m + splits * r) : INFINITY;
  }
  double reach(const Strip& s) const { return std::abs(s.a) * w + std::abs(s.b) * h; }
  bool inside(const Strip& s) const { return std::abs(s.c) + reach(s) <= s.h - s.tau; }
  bool apart(const Strip& s) const { return std::abs(s.c) - reach(s) >= s.h + s.tau; }
};

// What all covers of one frame have in common, seen from one target.
struct Relation {
  const Frame* frame = nullptr;
  double xi = 0, xj = 0, yi = 0, yj = 0, det = 0, det_magnitude = 0;
  double x = 0, y = 0, x_magnitude = 0, y_magnitude = 0;  // from the frame's anchor to the target's centre
  std::array<Strip, 2> strip{};                           // a and b only
  std::array<double, 2> reach{};

  Relation() = default;
  Relation(const Box& box, const Frame& target, const Frame& cover);
  std::array<Strip, 2> strips(const Box& box, const LatticeRect& r) const;
};

Relation::Relation(const Box& box, const Frame& target, const Frame& cover) : frame(&cover) {
  const std::array<double, 6>&t = target.numbers(), &q = cover.numbers();
  xi = q[1], xj = q[2], yi = q[4], yj = q[5];
  det = std::abs(xi * yj - xj * yi), det_magnitude = std::abs(xi * yj) + std::abs(xj * yi);
  const double x1 = t[1] * box.ci, x2 = t[2] * box.cj, y1 = t[4] * box.ci, y2 = t[5] * box.cj;
  const double x0 = t[0] - q[0], y0 = t[3] - q[3];
  x = x0 + (x1 + x2), x_magnitude = std::abs(x0) + std::abs(x1) + std::abs(x2);
  y = y0 + (y1 + y2), y_magnitude = std::abs(y0) + std::abs(y1) + std::abs(y2);
  strip[0] = {yj * t[1] - xj * t[4], yj * t[2] - xj * t[5], 0, 0, 0};
  strip[1] = {xi * t[4] - yi * t[1], xi * t[5] - yi * t[2], 0, 0, 0};
  reach[0] = (std::abs(yj * t[1]) + std::abs(xj * t[4])) * box.w +
             (std::abs(yj * t[2]) + std::abs(xj * t[5])) * box.h;
  reach[1] = (std::abs(xi * t[4]) + std::abs(yi * t[1])) * box.w +
             (std::abs(xi * t[5]) + std::abs(yi * t[2])) * box.h;
}

std::array<Strip, 2> Relation::strips(const Box& box, const LatticeRect& r) const {
  const double ki = 0.5 * (r.i0 + r.i1), kj = 0.5 * (r.j0 + r.j1);
  const double hi = 0.5 * (r.i1 - r.i0), hj = 0.5 * (r.j1 - r.j0);
  const double x1 = xi * ki, x2 = xj * kj, y1 = yi * ki, y2 = yj * kj;
  const double dx = x - (x1 + x2), mx = x_magnitude + std::abs(x1) + std::abs(x2);
  const double dy = y - (y1 + y2), my = y_magnitude + std::abs(y1) + std::abs(y2);
  std::array<Strip, 2> s = strip;
  s[0].c = yj * dx - xj * dy, s[0].h = det * hi;
  s[1].c = xi * dy - yi * dx, s[1].h = det * hj;
  s[0].tau = box.tau(std::abs(yj) * mx + std::abs(xj) * my + det_magnitude * (hi + std::abs(ki)), reach[0]);
  s[1].tau = box.tau(std::abs(xi) * my + std::abs(yi) * mx + det_magnitude * (hj + std::abs(kj)), reach[1]);
  return s;
}

// A cover of the target's own frame beside foreign ones.
std::array<Strip, 2> own_strips(const Box& box, const LatticeRect& r) {
  const double ki = 0.5 * (r.i0 + r.i1), kj = 0.5 * (r.j0 + r.j1);
  const double hi = 0.5 * (r.i1 - r.i0), hj = 0.5 * (r.j1 - r.j0);
  return {{{1, 0, box.ci - ki, hi, box.tau(std::abs(box.ci) + std::abs(ki) + hi, box.w)},
           {0, 1, box.cj - kj, hj, box.tau(std::abs(box.cj) + std::abs(kj) + hj, box.h)}}};
}

// The two edges of a strip shrunk by tau, each only if it may cut the target.
void add_edges(const Box& box, const Strip& s, bool low, bool high, Edges<double>& e) {
  const double h = s.h - s.tau, r = box.reach(s);
  if (low && !(h + s.c >= r)) e.add({s.a, s.b, h + s.c});
  if (high && !(h - s.c >= r)) e.add({-s.a, -s.b, h - s.c});
}

enum class Verdict { kCovered, kUncovered, kOpen };

// Foreign covers as strips; those that miss the target are left out. kCovered if one contains it.
Verdict gather_foreign(const OrientedRect& target, const Box& box, Scratch& s) {
  std::array<Relation, 4> known;  // covers of a few grids come in any order
  std::size_t oldest = 0;
  const auto relation = [&](const Frame& f) -> const Relation& {
    for (const Relation& r : known)
      if (r.frame == &f) return r;
    return known[oldest++ % known.size()] = Relation(box, *target.frame, f);
  };
  for (const OrientedRect* c : s.foreign) {
    const std::array<Strip, 2> strip = relation(*c->frame).strips(box, c->rect);
    if (box.apart(strip[0]) || box.apart(strip[1])) continue;
    if (box.inside(strip[0]) && box.inside(strip[1])) return Verdict::kCovered;
    s.near.push_back({strip});
    s.rest.push_back(*c);
  }
  return Verdict::kOpen;
}

void gather_own(const OrientedRect& target, const Box& box, Scratch& s) {
  for (const LatticeRect& r : s.own) {
    s.near.push_back({own_strips(box, r)});
    s.rest.push_back({target.frame, r});
  }
}

// A bit each for the centre and the four corners: set if the point may lie in the cover.
unsigned reached(const Box& box, const Near& n) {
  unsigned mask = 31;
  for (const Strip& s : n.strip) {
    const double h = s.h + s.tau, p = s.a * box.w + s.b * box.h, m = s.a * box.w - s.b * box.h;
    const std::array<double, 5> value{s.c, s.c + p, s.c - p, s.c + m, s.c - m};
    for (unsigned i = 0; i < 5; ++i) mask &= ~(unsigned{std::abs(value[i]) > h} << i);
  }
  return mask;
}

// True if the centre or a corner of the target is proved to lie in no cover.
bool point_missed(const Box& box, const Scratch& s) {
  unsigned mask = 0;
  for (const Near& n : s.near) mask |= reached(box, n);
  return mask != 31;
}

void shrink(const Box& box, std::size_t foreign, Scratch& s) {
  for (std::size_t k = 0; k < s.near.size(); ++k) {
    const std::array<Strip, 2>& strip = s.near[k].strip;
    const LatticeRect &r = s.rest[k].rect, &t = box.rect;
    const bool alien = k < foreign;  // in the target's own frame, edges on its outline never cut it
    s.edges.emplace_back();
    add_edges(box, strip[0], alien || r.i0 > t.i0, alien || r.i1 < t.i1, s.edges.back());
    add_edges(box, strip[1], alien || r.j0 > t.j0, alien || r.j1 < t.j1, s.edges.back());
  }
}

// True if the middle of the piece is proved to lie in no cover (tau allows for the rounded box around the
// target).
bool is_witness(const SmallPolygon& piece, const Scratch& s) {
  double u = 0, v = 0;
  for (std::size_t i = 0; i < piece.size(); ++i) u += piece[i].u, v += piece[i].v;
  const double n = static_cast<double>(piece.size());
  u /= n, v /= n;
  return std::all_of(s.near.begin(), s.near.end(), [&](const Near& c) { return c.outside(u, v); });
}

Verdict subtract_shrunk(const Box& box, Scratch& s) {
  SmallPolygon all;
  all.push_back({-box.w, -box.h}), all.push_back({box.w, -box.h});
  all.push_back({box.w, box.h}), all.push_back({-box.w, box.h});
  s.polygons.assign(1, {all, 0});
  bool sliver = false;
  const auto left = [&](const SmallPolygon& piece) {
    if (is_witness(piece, s)) return true;
    sliver = true;
    return false;
  };
  if (subtract(s.polygons, s.edges, left)) return Verdict::kUncovered;
  return sliver ? Verdict::kOpen : Verdict::kCovered;
}

// Area of a rectangle in numbers of type T, with a bound for its error: 2 roundings and a difference in the
// determinant, 2 differences, 2 products, taken as 8 epsilons (16 units) of the magnitudes.
template <class T>
struct Area {
  T value, error;
  explicit Area(const OrientedRect& r) {
    const std::array<double, 6>& n = r.frame->numbers();
    const T p = T(n[1]) * T(n[5]), q = T(n[2]) * T(n[4]);
    const T lattice = (T(r.rect.i1) - T(r.rect.i0)) * (T(r.rect.j1) - T(r.rect.j0));
    value = std::abs(p - q) * lattice;
    error = 8 * std::numeric_limits<T>::epsilon() * (std::abs(p) + std::abs(q)) * lattice;
  }
};

// The sign of the difference, or 0 if it is not certain.
template <class T>
int compare_rounded(const OrientedRect& a, const OrientedRect& b) {
  const Area<T> x(a), y(b);
  const T error = x.error + y.error, difference = x.value - y.value;
  if (!(error > T(kTiny) && error < T(kHuge)) || !(std::abs(difference) > error)) return 0;
  return difference > 0 ? 1 : -1;
}

// Width, height and area in lattice units, and which of them were not rounded.
struct LatticeArea {
  double w, h, area;
  bool exact_sides, exact;
  explicit LatticeArea(const LatticeRect& r) : w(r.i1 - r.i0), h(r.j1 - r.j0), area(w * h) {
    exact_sides = exact_difference(r.i1, r.i0, w) && exact_difference(r.j1, r.j0, h);
    exact = exact_sides && area > kTiny && area < kHuge && std::fma(w, h, -area) == 0;
  }
  // Knuth's two-sum: the rounding error of d = a - b is itself computed without error.
  static bool exact_difference(double a, double b, double d) {
    const double b_part = a - d, a_part = d + b_part;
    return (a - a_part) + (b_part - b) == 0;
  }
};

// Sets `sign` to that of x - y if exact doubles tell it: two exact products, or no side shorter than the
// other's.
bool compare_lattice(const LatticeArea& x, const LatticeArea& y, int& sign) {
  if (!x.exact_sides || !y.exact_sides) return false;
  const bool not_less = x.w >= y.w && x.h >= y.h, not_more = x.w <= y.w && x.h <= y.h;
  if (not_less || not_more) return sign = int{!not_more} - int{!not_less}, true;
  return sign = int{x.area > y.area} - int{x.area < y.area}, x.exact && y.exact;
}

bool same_linear_part(const Frame& a, const Frame& b) {
  const std::array<double, 6>&m = a.numbers(), &n = b.numbers();
  return &a == &b || (m[1] == n[1] && m[2] == n[2] && m[4] == n[4] && m[5] == n[5]);
}

}  // namespace

bool covered(const OrientedRect& target, std::span<const OrientedRect> covers, CoverageCounts& counts) {
  thread_local Scratch scratch;
  Scratch& s = scratch;
  s.clear();
  const auto decide = [](std::uint64_t& count, bool answer) { return ++count, answer; };
  if (target.rect.empty()) return decide(counts.integer, true);
  for (const OrientedRect& c : covers) {
    if (c.rect.empty()) continue;
    if (!same_frame(target, c)) {
      s.foreign.push_back(&c);
    } else if (overlap(c.rect, target.rect)) {
      if (contains(c.rect, target.rect)) return decide(counts.integer, true);
      s.own.push_back(c.rect);
    }
  }
  const Box box(target.rect, covers.size());
  if (gather_foreign(target, box, s) == Verdict::kCovered) return decide(counts.interval, true);
  const std::size_t foreign = s.near.size();
  if (foreign == 0) return decide(counts.integer, covered_by_own(target.rect, s));
  gather_own(target, box, s);
  if (point_missed(box, s)) return decide(counts.interval, false);
  shrink(box, foreign, s);
  const Verdict v = subtract_shrunk(box, s);
  if (v != Verdict::kOpen) return decide(counts.interval, v == Verdict::kCovered);
  return decide(counts.exact, coverage::covered_exact(target, s.rest));
}

int compare_areas(const OrientedRect& a, const OrientedRect& b, CoverageCounts& counts) {
  int sign = 0;
  if (same_linear_part(*a.frame, *b.frame) && compare_lattice(LatticeArea(a.rect), LatticeArea(b.rect), sign))
    return ++counts.integer, sign;
  // Grids of equal steps at different angles differ in the 17th digit: extended precision saves them the
  // rationals.
  sign = compare_rounded<double>(a, b);
  if (sign == 0) sign = compare_rounded<long double>(a, b);
  if (sign != 0) return ++counts.interval, sign;
  return ++counts.exact, coverage::compare_areas_exact(a, b);
}

}  // namespace patchwork
