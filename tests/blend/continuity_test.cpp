// ContinuityCk (hard cases): across every rim the derivatives up to k are continuous, and derivative k + 1 is
// not.
#include <gtest/gtest.h>

#include "blend/weight.h"
#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

// A place on a line where the formula of the surface changes, and the direction across it.
struct Crossing {
  Point at, across;
};

// A quarter of the step leaves a quarter of the difference where a derivative is continuous, all of a jump.
constexpr double kFalls = 0.35;

constexpr double kBinomial[4][4] = {{1, 0, 0, 0}, {1, -1, 0, 0}, {1, -2, 1, 0}, {1, -3, 3, -1}};

// The jump of derivative j over each crossing: one-sided differences with step h on either side.
std::vector<double> jumps(const Database& db, double error, const BlendOptions& options,
                          const std::vector<Crossing>& crossings, int j, double h) {
  Points points;
  for (const Crossing& c : crossings)
    for (const int side : {1, -1})
      for (int n = 0; n <= j; ++n) {
        const double s = side * h * (n + 0.5);
        points.add(c.at.x + s * c.across.x, c.at.y + s * c.across.y);
      }
  const Answers a = evaluate(db, error, points, options);
  std::vector<double> result;
  for (std::size_t c = 0, at = 0; c < crossings.size(); ++c) {
    double derivative[2] = {0, 0};
    for (const int side : {0, 1})
      for (int n = 0; n <= j; ++n) {
        const double sign = side == 0 && j % 2 == 1 ? -1 : 1;  // differences run outward
        derivative[side] += sign * kBinomial[j][n] * a.height[at++];
      }
    result.push_back(std::abs(derivative[0] - derivative[1]) / std::pow(h, j));
  }
  return result;
}

double largest(const std::vector<double>& v) {
  double most = 0;
  for (const double x : v)
    if (x > most) most = x;  // NaN: a stencil that leaves the data
  return most;
}

// Random points on the edges of a lattice rectangle.
void add_edges(const Grid& g, const LatticeRect& r, std::mt19937_64& random, std::vector<Crossing>& out) {
  std::uniform_real_distribution<double> part(0.001, 0.999);
  const Frame& f = g.info.frame;
  const auto& n = f.numbers();
  const Point along_i{n[1] / f.step_i(), n[4] / f.step_i()}, along_j{n[2] / f.step_j(), n[5] / f.step_j()};
  for (const double i : {r.i0, r.i1})
    out.push_back({f.to_domain(i, r.j0 + part(random) * (r.j1 - r.j0)), along_i});
  for (const double j : {r.j0, r.j1})
    out.push_back({f.to_domain(r.i0 + part(random) * (r.i1 - r.i0), j), along_j});
}

// A corner, across both diagonals.
void add_corner(const Grid& g, double i, double j, std::vector<Crossing>& out) {
  const Frame& f = g.info.frame;
  const auto& n = f.numbers();
  const double si = std::sqrt(2) * f.step_i(), sj = std::sqrt(2) * f.step_j();
  for (const double sign : {1.0, -1.0})
    out.push_back({f.to_domain(i, j), {n[1] / si + sign * n[2] / sj, n[4] / si + sign * n[5] / sj}});
}

// Where two grids both end and none lies below, each speaks for its last, extrapolated half cell alone.
bool only_rims_meet(const Database& db, Point p) {
  int reached = 0;
  for (const Grid& g : db.grids()) {
    const GridShape& shape = g.info.shape;
    if (holds(g, shape.samples(), p)) return false;
    reached += holds(g, shape.footprint(), p);
  }
  return reached > 1;
}

bool is_hole(int i, int j) { return i > 30 && i < 50 && j > 20 && j < 33; }

class ContinuityCk : public ::testing::TestWithParam<BlendOptions> {
 protected:
  static void SetUpTestSuite() {
    std::vector<GridFile> grids = surveys();
    for (std::size_t k = 1; k < grids.size(); ++k)  // so that every seam is a step of metres
      grids[k].at = [at = grids[k].at, k](int i, int j) {
        return k == 1 && is_hole(i, j) ? kHole : at(i, j) + 3.0 * double(k);
      };
    scene_ = std::make_unique<Land>(grids);
  }
  static void TearDownTestSuite() { scene_.reset(); }
  static const Database& db() { return scene_->db(); }

  // Kernel rims and domain rims of all patches of a cut: LOD changes and grid borders are among them.
  static std::vector<Crossing> rims(double error) {
    std::mt19937_64 random(test_seed(1));
    std::vector<Crossing> all;
    for (const PatchId id : extract(db(), {.error = error}).patches) {
      const Grid& g = db().grid(id.grid());
      const GridShape& shape = g.info.shape;
      for (int n = 0; n < 4; ++n) {
        add_edges(g, shape.kernel(id.level(), id.bx(), id.by()), random, all);
        add_edges(g, shape.domain(id.level(), id.bx(), id.by()), random, all);
      }
    }
    std::erase_if(all, [](const Crossing& c) { return only_rims_meet(db(), c.at); });
    return all;
  }
  // Corners of kernels and of domains, and halfway between them, where ramps along both axes are alike.
  static std::vector<Crossing> corners(double error) {
    std::vector<Crossing> all;
    for (const PatchId id : extract(db(), {.error = error}).patches) {
      const Grid& g = db().grid(id.grid());
      const LatticeRect k = g.info.shape.kernel(id.level(), id.bx(), id.by());
      const LatticeRect d = g.info.shape.domain(id.level(), id.bx(), id.by());
      for (const double part : {0.0, 0.5, 1.0})
        for (const auto& [ki, di] : {std::pair{k.i0, d.i0}, {k.i1, d.i1}})
          for (const auto& [kj, dj] : {std::pair{k.j0, d.j0}, {k.j1, d.j1}})
            add_corner(g, ki + part * (di - ki), kj + part * (dj - kj), all);
    }
    std::erase_if(all, [](const Crossing& c) { return only_rims_meet(db(), c.at); });
    return all;
  }
  static std::vector<Crossing> cells_around_the_hole() {
    std::mt19937_64 random(test_seed(2));
    std::vector<Crossing> all;
    const Grid& g = db().grids()[1];
    for (double j = 10; j < 44; ++j)
      for (double i = 20; i < 60; ++i) add_edges(g, {i, j, i + 1, j + 1}, random, all);
    return all;
  }
  // Does a jump of derivative j stay, somewhere, when the step is a quarter? Small ones are rounding.
  static bool jumps_stay(double error, const std::vector<Crossing>& at, int j, double h) {
    const std::vector<double> wide = jumps(db(), error, GetParam(), at, j, h);
    const std::vector<double> narrow = jumps(db(), error, GetParam(), at, j, h / 4);
    const double least = 0.03 * largest(wide);
    for (std::size_t c = 0; c < at.size(); ++c)
      if (narrow[c] > least && narrow[c] > 0.7 * wide[c]) return true;
    return false;
  }
  static void expect_continuous(const std::vector<double>& errors,
                                const std::vector<std::vector<Crossing>>& at) {
    constexpr double h = 0.02;  // metres, 1/125 of the smallest cell
    const int k = GetParam().smoothness;
    double worst = 0;
    std::uint64_t tries = 0;
    for (int j = 0; j <= k; ++j)
      for (std::size_t n = 0; n < errors.size(); ++n) {
        const double wide = largest(jumps(db(), errors[n], GetParam(), at[n], j, h));
        const double narrow = largest(jumps(db(), errors[n], GetParam(), at[n], j, h / 4));
        EXPECT_LT(narrow, kFalls * wide) << "derivative " << j << " at error " << errors[n];
        worst = std::max(worst, narrow / wide), tries += at[n].size();
        EXPECT_GT(wide, 0);
      }
    // Wendland's function of k = 1 is that of k = 2: smoother than asked for.
    const int next = GetParam().composition == Composition::weighted && k == 1 ? 3 : k + 1;
    bool stay = false;
    for (std::size_t n = 0; n < errors.size(); ++n) stay |= jumps_stay(errors[n], at[n], next, h / 4);
    EXPECT_TRUE(stay) << "negative control: derivative " << next << " jumps";
    report_case("ContinuityCk", "jumps at a quarter of the step, " + name_of(GetParam()), tries, worst,
                kFalls, "of those at the step");
  }
  static std::unique_ptr<Land> scene_;
};
std::unique_ptr<Land> ContinuityCk::scene_;

TEST_P(ContinuityCk, AcrossKernelRimsDomainRimsAndLevels) {
  const std::vector<double> errors{0, 1.5, 3, 6, 15};
  std::vector<std::vector<Crossing>> at;
  for (const double error : errors) at.push_back(rims(error));
  expect_continuous(errors, at);
}

TEST_P(ContinuityCk, AcrossTheCellsAroundAHole) {
  const std::vector<Crossing> cells = cells_around_the_hole();
  expect_continuous({0, 12, 25}, {cells, cells, cells});
}

TEST_P(ContinuityCk, AcrossCornersOfKernelsAndDomainsAndBetweenThem) {
  const std::vector<double> errors{0, 3, 15};
  std::vector<std::vector<Crossing>> at;
  for (const double error : errors) at.push_back(corners(error));
  expect_continuous(errors, at);
}

TEST_P(ContinuityCk, AcrossTheVerticesAroundAHole) {
  std::vector<Crossing> vertices;
  for (int j = 19; j < 35; ++j)
    for (int i = 29; i < 52; ++i) add_corner(db().grids()[1], i, j, vertices);
  expect_continuous({0, 12, 25}, {vertices, vertices, vertices});
}

// The naive form of a weight over a corner, the smaller of two ramps: continuous across every edge, it has a
// crease where they are equal. Slopes away from s = t = 1/2 on either side add up to the jump: of the product
// 2 h w'' with w'' = -2 S'^2, of the smaller -2 S' whatever the step.
TEST(ContinuityCkOfWeights, TheSmallerOfTwoRampsHasACreaseInTheCorner) {
  const auto jump = [](auto weight, double h) {
    const auto slope = [&](double side) {
      const double near = 0.5 * side * h, far = 1.5 * side * h;
      return (weight(0.5 + far, 0.5 - far) - weight(0.5 + near, 0.5 - near)) / h;
    };
    return std::abs(slope(1) + slope(-1));
  };
  const auto product = [](double s, double t) { return smoothstep<2>(s) * smoothstep<2>(t); };
  const auto smaller = [](double s, double t) { return std::min(smoothstep<2>(s), smoothstep<2>(t)); };
  EXPECT_LT(jump(product, 0.005), kFalls * jump(product, 0.02));
  EXPECT_GT(jump(smaller, 0.005), 0.7 * jump(smaller, 0.02)) << "negative control";
}

// Patches of several levels side by side in the extrapolated half cell around a grid, where nothing else
// speaks.
TEST_P(ContinuityCk, AcrossLevelsAlongTheRimOfAllData) {
  GridFile file{.width = 160, .height = 120, .geotransform = {0, 8, 0, 960, 0, -8}, .accuracy = 0.1};
  file.at = [](int i, int j) { return 3 * std::sin(i * j / 900.0) + 8 * std::cos(i / 40.0); };
  const Land one({file});
  const Grid& g = one.db().grids()[0];
  const double error = g.at(1, 1, 1).bottom;
  std::vector<Crossing> crossings;
  std::size_t levels = 0;
  for (const PatchId id : extract(one.db(), {.error = error}).patches) {
    levels |= std::size_t{1} << id.level();
    const LatticeRect kernel = g.info.shape.kernel(id.level(), id.bx(), id.by());
    const LatticeRect domain = g.info.shape.domain(id.level(), id.bx(), id.by());
    for (const LatticeRect& r : {kernel, domain})
      for (const double part : {0.1, 0.25, 0.4}) {
        for (const double i : {r.i0, r.i1})
          for (const double j : {-part, file.height - 1 + part})
            crossings.push_back({g.info.frame.to_domain(i, j), {1, 0}});
        for (const double j : {r.j0, r.j1})
          for (const double i : {-part, file.width - 1 + part})
            crossings.push_back({g.info.frame.to_domain(i, j), {0, 1}});
      }
  }
  ASSERT_NE(levels & (levels - 1), 0u) << "patches of one level only";
  for (int j = 0; j <= GetParam().smoothness; ++j) {
    const double wide = largest(jumps(one.db(), error, GetParam(), crossings, j, 0.02));
    EXPECT_LT(largest(jumps(one.db(), error, GetParam(), crossings, j, 0.005)), kFalls * wide)
        << "derivative " << j;
  }
}

INSTANTIATE_TEST_SUITE_P(Blends, ContinuityCk, ::testing::ValuesIn(all_blends()), [](const auto& p) {
  std::string name = name_of(p.param);
  for (char& c : name)
    if (c == ' ' || c == '=') c = '_';
  return name;
});

}  // namespace
}  // namespace patchwork
