// What the tests of the blend share: a terrain, grids over it with honest accuracies, and evaluation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "blend/blend.h"
#include "query/extract.h"
#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {

/// Hills, ridges and ripples of some 100 m over 2 km: every level of every grid has an error of its own.
inline double hills(double x, double y) {
  return 300 + 60 * std::sin(x / 310) * std::cos(y / 270) + 9 * std::sin(x / 61 + y / 83) +
         1.5 * std::cos(x / 17 - y / 23);
}

/// The largest distance between the terrain and the bilinear surface of the grid's samples, with a quarter
/// more; measured at 5 x 5 points of every cell.
inline double honest_accuracy(const GridFile& file, const std::function<double(double, double)>& terrain) {
  const Frame frame = Frame::from_geotransform(file.geotransform, "test");
  double worst = 0;
  for (int j = 0; j + 1 < file.height; ++j)
    for (int i = 0; i + 1 < file.width; ++i) {
      const double a = file.at(i, j), b = file.at(i + 1, j), c = file.at(i, j + 1), d = file.at(i + 1, j + 1);
      for (int k = 0; k < 25; ++k) {
        const double s = k % 5 / 4.0, t = k / 5 / 4.0;
        const double h = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
        const Point p = frame.to_domain(i + s, j + t);
        worst = std::max(worst, std::abs(h - terrain(p.x, p.y)));
      }
    }
  return 1.25 * worst + 1e-4;
}

/// The grid over `hills`, its samples off by at most `noise` metres, its accuracy measured.
inline GridFile survey(GridFile file, double noise) {
  file = of_terrain(file, hills);
  file.at = [exact = file.at, noise](int i, int j) {
    return exact(i, j) + noise * std::sin(12.9898 * i + 78.233 * j);
  };
  file.accuracy = honest_accuracy(file, hills);
  return file;
}

/// A coarse base, three rotated surveys of 8, 4 and 2.5 m, one of them mirrored.
inline std::vector<GridFile> surveys() {
  return {survey({.width = 91, .height = 80, .geotransform = {0, 20, 0, 1600, 0, -20}}, 0.5),
          survey({.width = 90, .height = 70, .geotransform = rotated(250, 1100, 17, 8, 8)}, 0.1),
          survey({.width = 120, .height = 90, .geotransform = rotated(700, 1300, -33, 4, 5)}, 0.2),
          survey({.width = 100,
                  .height = 100,
                  .geotransform = {1250, 0.7, 2.4, 500, 2.4, -0.7},
                  .pixel_is_area = false},
                 0.05)};
}

struct Points {
  std::vector<double> x, y;
  std::size_t size() const { return x.size(); }
  void add(double px, double py) { x.push_back(px), y.push_back(py); }
  void add(Point p) { add(p.x, p.y); }
};

inline Points random_points(const Extent& e, std::size_t n, std::mt19937_64& random) {
  std::uniform_real_distribution<double> x(e.xmin, e.xmax), y(e.ymin, e.ymax);
  Points points;
  for (std::size_t k = 0; k < n; ++k) points.add(x(random), y(random));
  return points;
}

struct Answers {
  explicit Answers(std::size_t n) : height(n), bound(n), source(n), patch(n) {}
  BlendOutput out() { return {height, bound, source, patch}; }
  // Bits and not values: NaN equals itself.
  bool operator==(const Answers& o) const {
    const auto same = [](const std::vector<double>& a, const std::vector<double>& b) {
      return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
    };
    return same(height, o.height) && same(bound, o.bound) && source == o.source && patch == o.patch;
  }
  std::vector<double> height, bound;
  std::vector<std::int32_t> source, patch;
};

inline Answers evaluate(const Database& db, std::span<const PatchId> patches, const Points& points,
                        const BlendOptions& options = {}) {
  Answers a(points.size());
  Blend(db, patches, options).at_points(points.x, points.y, a.out());
  return a;
}

inline Answers evaluate(const Database& db, double error, const Points& points, BlendOptions options = {}) {
  options.error = error;
  const Extraction x = extract(db, {.error = error, .strict = options.strict});
  return evaluate(db, x.patches, points, options);
}

/// Every smoothness with both compositions.
inline std::vector<BlendOptions> all_blends() {
  std::vector<BlendOptions> all;
  for (const Composition c : {Composition::priority, Composition::weighted})
    for (int k = 0; k <= 2; ++k) all.push_back({.smoothness = k, .composition = c});
  return all;
}

inline std::string name_of(const BlendOptions& o) {
  return std::string(o.composition == Composition::priority ? "priority" : "weighted") +
         " k=" + std::to_string(o.smoothness);
}

/// A folder with one database in it.
class Land {
 public:
  explicit Land(const std::vector<GridFile>& grids) : db_(folder_.database()) {
    for (const GridFile& g : grids) folder_.add(db_, g, "grid" + std::to_string(db_.grids().size()));
  }
  const Database& db() const { return db_; }

 private:
  GridFolder folder_;
  Database db_;
};

/// Lattice coordinates of `p` lie in `r`.
inline bool holds(const Grid& g, const LatticeRect& r, Point p) {
  const Point q = g.info.frame.to_lattice(p.x, p.y);
  return q.x >= r.i0 && q.x <= r.i1 && q.y >= r.j0 && q.y <= r.j1;
}

/// Calls visit(grid, index, block) for every patch there is, redundant or not.
template <class Visit>
void each_patch(const Database& db, Visit visit) {
  for (const Grid& g : db.grids())
    for (std::size_t k = 0; k < g.patches.size(); ++k)
      if (g.patches[k].exists()) visit(g, k, g.info.shape.block(k));
}

}  // namespace patchwork
