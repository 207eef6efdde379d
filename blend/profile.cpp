#include "blend/profile.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "db/error.h"

namespace patchwork {

namespace {

constexpr double kMostPoints = 1e8;

double steps_of(const Point& a, const Point& b, double step) {
  return std::max(1.0, std::ceil(std::hypot(b.x - a.x, b.y - a.y) / step));
}

void check(std::span<const Point> line, double step) {
  if (line.size() < 2) throw Error("line", "it needs at least two points");
  if (!(step > 0) || !std::isfinite(step)) throw Error("step", "it must be a number of metres above 0");
  double points = 1;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (!std::isfinite(line[k].x) || !std::isfinite(line[k].y)) throw Error("line", "a corner is not finite");
    if (k > 0) points += steps_of(line[k - 1], line[k], step);
  }
  if (!(points <= kMostPoints)) throw Error("line", "it has more than 10^8 points", "take longer steps");
}

void summarise(Profile& p) {
  p.lowest = p.highest = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < p.points.size(); ++k) {
    const double h = p.points[k].height;
    if (!std::isnan(h)) {
      p.lowest = std::fmin(p.lowest, h), p.highest = std::fmax(p.highest, h);
      p.bound_max = std::max(p.bound_max, p.points[k].bound);
    }
    if (k == 0) continue;
    const double climb = h - p.points[k - 1].height;
    if (std::isnan(climb))
      p.missing += p.points[k].distance - p.points[k - 1].distance;
    else
      (climb > 0 ? p.ascent : p.descent) += std::abs(climb);
  }
}

}  // namespace

Profile profile_along(const Evaluator& surface, std::span<const Point> line, double step) {
  check(line, step);
  std::vector<double> x{line[0].x}, y{line[0].y}, distance{0};
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Point &a = line[k - 1], &b = line[k];
    const double n = steps_of(a, b, step), leg = std::hypot(b.x - a.x, b.y - a.y), before = distance.back();
    for (double i = 1; i < n; ++i) {
      x.push_back(a.x + (b.x - a.x) * (i / n)), y.push_back(a.y + (b.y - a.y) * (i / n));
      distance.push_back(before + leg * (i / n));
    }
    x.push_back(b.x), y.push_back(b.y), distance.push_back(before + leg);
  }
  std::vector<double> height(x.size()), bound(x.size());
  std::vector<std::int32_t> source(x.size());
  surface.at_points(x, y, {.height = height, .bound = bound, .source = source, .patch = {}});
  Profile profile;
  for (std::size_t k = 0; k < x.size(); ++k)
    profile.points.push_back({distance[k], {x[k], y[k]}, height[k], bound[k], source[k]});
  profile.length = distance.back();
  summarise(profile);
  return profile;
}

}  // namespace patchwork
