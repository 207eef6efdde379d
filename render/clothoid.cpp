#include "render/clothoid.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <numbers>

#include "db/error.h"

namespace patchwork {

namespace {

using Quadrature = boost::math::quadrature::gauss<double, 30>;

// Of a turn's phase t^2 a / 2 + t b + c: 30 points resolve a few turns, longer arcs are halved.
constexpr double kTurnsAtOnce = 12;  // radians

struct Integral {
  double cos = 0, sin = 0;
};

template <class Phase>
Integral integral(const Phase& phase, double from, double to, double turning) {
  if (turning > kTurnsAtOnce) {
    const double middle = 0.5 * (from + to);
    const Integral p = integral(phase, from, middle, turning / 2),
                   q = integral(phase, middle, to, turning / 2);
    return {p.cos + q.cos, p.sin + q.sin};
  }
  return {Quadrature::integrate([&](double t) { return std::cos(phase(t)); }, from, to),
          Quadrature::integrate([&](double t) { return std::sin(phase(t)); }, from, to)};
}

// To (-pi, pi].
double normal(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

// The root of g(A) = integral over [0, 1] of sin(A t^2 + (delta - A) t + phi0), the paper's theorem 1.
double sharpness(double phi0, double phi1) {
  const double delta = phi1 - phi0;
  const auto phase = [&](double a) { return [=](double t) { return (a * t + (delta - a)) * t + phi0; }; };
  // The paper's first guess, equation 17.
  const double x = phi0 / std::numbers::pi, y = phi1 / std::numbers::pi, xy = x * y, d = x * x + y * y;
  double a = (phi0 + phi1) * (2.989696028701907 + xy * (0.716228953608281 - 0.458969738821509 * xy) +
                              (0.261062141752652 * xy - 0.502821153340377) * d - 0.045854475238709 * d * d);
  for (int n = 0; n < 20; ++n) {
    const auto p = phase(a);
    const double g = integral(p, 0, 1, std::abs(a) + std::abs(delta)).sin;
    const double slope =
        Quadrature::integrate([&](double t) { return std::cos(p(t)) * t * (t - 1); }, 0.0, 1.0);
    const double step = g / slope;
    a -= step;
    if (std::abs(step) < 1e-14 * (1 + std::abs(a))) break;
  }
  return a;
}

}  // namespace

Point Clothoid::at(double s) const {
  const double turning = std::abs(s) * (std::abs(curvature) + 0.5 * std::abs(s * rate));
  const Integral i = integral([this](double t) { return heading_at(t); }, 0, s, turning);
  return {start.x + i.cos, start.y + i.sin};
}

Clothoid Clothoid::between(Point a, double heading_a, Point b, double heading_b) {
  const double distance = std::hypot(b.x - a.x, b.y - a.y), chord = std::atan2(b.y - a.y, b.x - a.x);
  const double phi0 = normal(heading_a - chord), phi1 = normal(heading_b - chord), delta = phi1 - phi0;
  const double sharp = sharpness(phi0, phi1);
  const auto phase = [=](double t) { return (sharp * t + (delta - sharp)) * t + phi0; };
  const double reach = integral(phase, 0, 1, std::abs(sharp) + std::abs(delta)).cos;
  const double length = distance / reach;
  return {a, heading_a, (delta - sharp) / length, 2 * sharp / (length * length), length};
}

namespace {

// The chain's unknowns are the headings at the points; each equation says that the curvature does not jump at
// a point, or is 0 at an end; it touches the heading before, at and after the point only.
class Chain {
 public:
  explicit Chain(const std::vector<Point>& points) : points_(points) {}

  std::vector<double> first_guess() const {
    const std::size_t n = points_.size();
    std::vector<double> headings(n), chords(n - 1), lengths(n - 1);
    for (std::size_t k = 0; k + 1 < n; ++k) {
      const double x = points_[k + 1].x - points_[k].x, y = points_[k + 1].y - points_[k].y;
      lengths[k] = std::hypot(x, y);
      chords[k] = k == 0 ? std::atan2(y, x) : chords[k - 1] + normal(std::atan2(y, x) - chords[k - 1]);
    }
    // The circle through three points turns in proportion to its arcs.
    for (std::size_t k = 1; k + 1 < n; ++k)
      headings[k] =
          chords[k - 1] + (chords[k] - chords[k - 1]) * lengths[k - 1] / (lengths[k - 1] + lengths[k]);
    headings[0] = chords[0] - 0.5 * (headings[1] - chords[0]);
    headings[n - 1] = chords[n - 2] - 0.5 * (headings[n - 2] - chords[n - 2]);
    return headings;
  }

  Clothoid arc(std::size_t k, double heading_a, double heading_b) const {
    return Clothoid::between(points_[k], heading_a, points_[k + 1], heading_b);
  }

  // Jumps of curvature times the mean length of the arcs; infinite where an arc has none.
  std::vector<double> jumps(const std::vector<double>& headings) const {
    const std::size_t n = points_.size();
    std::vector<double> r(n);
    Clothoid before{};
    for (std::size_t k = 0; k < n; ++k) {
      if (k + 1 == n) {
        r[k] = before.curvature_at(before.length) * before.length;
        break;
      }
      const Clothoid now = arc(k, headings[k], headings[k + 1]);
      if (!(now.length > 0) || !std::isfinite(now.length)) return std::vector<double>(n, INFINITY);
      r[k] = k == 0
                 ? now.curvature * now.length
                 : (before.curvature_at(before.length) - now.curvature) * 0.5 * (before.length + now.length);
      before = now;
    }
    return r;
  }

  // One step of Newton's method: every third heading is moved at once, as no equation sees two of them.
  std::vector<double> newton_step(const std::vector<double>& headings, const std::vector<double>& r) const {
    const std::size_t n = points_.size();
    std::vector<double> below(n), middle(n), above(n);
    constexpr double h = 1e-6;
    for (std::size_t part = 0; part < 3; ++part) {
      std::vector<double> plus = headings, minus = headings;
      for (std::size_t k = part; k < n; k += 3) plus[k] += h, minus[k] -= h;
      const std::vector<double> p = jumps(plus), m = jumps(minus);
      for (std::size_t k = part; k < n; k += 3) {
        const auto slope = [&](std::size_t row) { return (p[row] - m[row]) / (2 * h); };
        middle[k] = slope(k);
        if (k > 0) above[k - 1] = slope(k - 1);
        if (k + 1 < n) below[k + 1] = slope(k + 1);
      }
    }
    std::vector<double> step = r;
    for (std::size_t k = 1; k < n; ++k) {  // Thomas' elimination
      const double f = below[k] / middle[k - 1];
      middle[k] -= f * above[k - 1], step[k] -= f * step[k - 1];
    }
    step[n - 1] /= middle[n - 1];
    for (std::size_t k = n - 1; k-- > 0;) step[k] = (step[k] - above[k] * step[k + 1]) / middle[k];
    return step;
  }

 private:
  const std::vector<Point>& points_;
};

double largest(const std::vector<double>& r) {
  double most = 0;
  for (const double v : r) most = std::isfinite(v) ? std::max(most, std::abs(v)) : INFINITY;
  return most;
}

double squares(const std::vector<double>& r) {
  double sum = 0;
  for (const double v : r) sum += v * v;
  return sum;
}

constexpr double kSettled = 1e-9;  // radians of turn over an arc: what counts as no jump

// Newton with halved steps while the jumps do not become smaller.
bool settle(const Chain& chain, std::vector<double>& headings) {
  std::vector<double> r = chain.jumps(headings);
  for (int n = 0; n < 100 && largest(r) > kSettled; ++n) {
    const std::vector<double> step = chain.newton_step(headings, r);
    if (!std::isfinite(squares(step))) return false;
    const double most = largest(step);
    double part = most > 0.5 ? 0.5 / most : 1;
    for (int halved = 0;; ++halved, part *= 0.5) {
      if (halved == 30) return false;
      std::vector<double> next = headings;
      for (std::size_t k = 0; k < next.size(); ++k) next[k] -= part * step[k];
      std::vector<double> left = chain.jumps(next);
      if (!(squares(left) < squares(r))) continue;
      headings = std::move(next), r = std::move(left);
      break;
    }
  }
  return largest(r) <= kSettled;
}

}  // namespace

std::vector<Clothoid> clothoids_through(const std::vector<Point>& points) {
  if (points.size() < 2) throw Error("path", "it needs at least two points");
  for (std::size_t k = 1; k < points.size(); ++k)
    if (points[k].x == points[k - 1].x && points[k].y == points[k - 1].y)
      throw Error("path",
                  "points " + std::to_string(k - 1) + " and " + std::to_string(k) + " lie at the same place");
  const Chain chain(points);
  std::vector<double> headings;
  if (points.size() == 2) {
    headings.assign(2, std::atan2(points[1].y - points[0].y, points[1].x - points[0].x));
  } else {
    headings = chain.first_guess();
    if (!settle(chain, headings))
      throw Error("path", "no way of continuous curvature was found through its points",
                  "add points where it turns sharply");
  }
  std::vector<Clothoid> arcs;
  for (std::size_t k = 0; k + 1 < points.size(); ++k)
    arcs.push_back(chain.arc(k, headings[k], headings[k + 1]));
  return arcs;
}

}  // namespace patchwork
