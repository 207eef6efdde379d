// NodataEdges (hard cases), the blend's side: data answer up to their last edge, holes stay holes, nothing
// leaks.
#include <gtest/gtest.h>

#include "tests/blend/scene.h"
#include "tests/hard_case.h"

namespace patchwork {
namespace {

constexpr double kErrors[] = {0, 0.5, 5, 20, 100, 1000};
constexpr double kStep = 8;

using IsHole = std::function<bool(int, int)>;

struct Holes {
  const char* name;
  IsHole at;
};

// Vertices without data.
const Holes kPatterns[] = {
    {"OneVertex", [](int i, int j) { return i == 47 && j == 31; }},
    {"GridOfHoles", [](int i, int j) { return i % 9 == 4 && j % 7 == 3; }},
    {"Checkerboard", [](int i, int j) { return (i / 3 + j / 3) % 2 == 1; }},
    {"Corner", [](int i, int j) { return i + j < 70; }},
    {"OnlyTheFarRim", [](int i, int j) { return i < 113 && j < 85; }},
    {"OnlyOneCell", [](int i, int j) { return i < 60 || i > 61 || j < 40 || j > 41; }},
    {"Stripes", [](int i, int) { return i % 4 == 0; }},
};

GridFile with_holes(const IsHole& hole, double nodata) {
  GridFile g{.width = 115, .height = 87, .geotransform = {800, kStep, 0, 1600, 0, -kStep}};
  g.nodata = nodata, g.accuracy = 0.2, g.pixel_is_area = false;
  g.at = [hole](int i, int j) {
    return hole(i, j) ? kHole
                      : 100 + 5 * std::sin(i / 9.0) + 4 * std::cos(j / 7.0) + (i * 7 + j * 3) % 5 / 4.0;
  };
  return g;
}

bool cell_is_valid(const GridFile& g, const IsHole& hole, int i, int j) {
  if (i < 0 || j < 0 || i + 1 >= g.width || j + 1 >= g.height) return false;
  return !(hole(i, j) || hole(i + 1, j) || hole(i, j + 1) || hole(i + 1, j + 1));
}

class NodataEdges : public ::testing::TestWithParam<Holes> {
 protected:
  NodataEdges() : file_(with_holes(GetParam().at, -9999)), frame_(frame_of(file_)) {}
  static Frame frame_of(const GridFile& g) { return Frame::from_geotransform(g.geotransform, "test"); }
  bool valid(int i, int j) const { return cell_is_valid(file_, GetParam().at, i, j); }

  // Corners, middles of edges and a point inside every cell whose validity is `wanted`.
  Points cells(bool wanted, std::initializer_list<double> parts) const {
    Points points;
    for (int j = 0; j + 1 < file_.height; ++j)
      for (int i = 0; i + 1 < file_.width; ++i)
        if (valid(i, j) == wanted)
          for (const double s : parts)
            for (const double t : parts) points.add(frame_.to_domain(i + s, j + t));
    return points;
  }
  // Metres from a point to the nearest valid cell; infinity if none is within `most`.
  double distance_to_data(Point p, double most) const {
    const Point q = frame_.to_lattice(p.x, p.y);
    const int reach = int(most / kStep) + 1;
    double nearest = INFINITY;
    for (int j = int(q.y) - reach; j <= int(q.y) + reach; ++j)
      for (int i = int(q.x) - reach; i <= int(q.x) + reach; ++i)
        if (valid(i, j)) {
          const double di = std::max({0.0, i - q.x, q.x - i - 1}), dj = std::max({0.0, j - q.y, q.y - j - 1});
          nearest = std::min(nearest, kStep * std::hypot(di, dj));
        }
    return nearest;
  }
  GridFile file_;
  Frame frame_;
};

TEST_P(NodataEdges, EveryValidCellAnswersAtEveryErrorUpToItsCorners) {
  const Land scene({file_});
  const Points points = cells(true, {0, 0.3, 0.5, 1});
  ASSERT_GT(points.size(), 0u);
  for (const double error : kErrors)
    for (const BlendOptions& options : all_blends()) {
      const Answers a = evaluate(scene.db(), error, points, options);
      for (std::size_t k = 0; k < points.size(); ++k) {
        const Point q = frame_.to_lattice(points.x[k], points.y[k]);
        ASSERT_NE(a.source[k], 0) << name_of(options) << " error " << error << " vertex " << q.x << " "
                                  << q.y;
        ASSERT_TRUE(a.height[k] > 85 && a.height[k] < 115) << "nodata leaks: " << a.height[k];
      }
    }
  report_law("NodataEdges", std::string("valid cells answer at every error, ") + GetParam().name,
             36 * points.size());
}

// The naive form: bilinear between samples of which some are -9999.
TEST_P(NodataEdges, PlainInterpolationWouldLeak) {
  std::size_t leaks = 0;
  for (int j = 0; j + 1 < file_.height; ++j)
    for (int i = 0; i + 1 < file_.width; ++i) {
      double sum = 0;
      for (const auto& [a, b] : {std::pair{i, j}, {i + 1, j}, {i, j + 1}, {i + 1, j + 1}})
        sum += GetParam().at(a, b) ? -9999 : file_.at(a, b);
      leaks += sum / 4 < 85 && sum / 4 > -9998;
    }
  EXPECT_GT(leaks, 0u) << "negative control";
}

TEST_P(NodataEdges, HolesAreExactAtLevelZeroAndToTheErrorAboveIt) {
  const Land scene({file_});
  const Points inside = cells(false, {0.01, 0.99});
  for (const double error : {0.0, 0.5, 5.0, 20.0, 50.0}) {
    const Answers a = evaluate(scene.db(), error, inside);
    for (std::size_t k = 0; k < inside.size(); ++k) {
      if (a.source[k] == 0) continue;
      ASSERT_LT(a.source[k], 0) << "a filled cell says that it is filled";
      ASSERT_LE(distance_to_data({inside.x[k], inside.y[k]}, error), error) << "error " << error;
    }
  }
  const Answers coarsest = evaluate(scene.db(), 1e6, inside);
  EXPECT_NE(std::count(coarsest.source.begin(), coarsest.source.end(), -1), 0)
      << "negative control: the root answers in holes";
}

TEST_P(NodataEdges, NoPinholeWhereAnotherGridHasData) {
  GridFile base{.width = 90, .height = 80, .geotransform = {700, 13, 0, 1700, 0, -13}, .accuracy = 3};
  base.at = [](int i, int j) { return 102 + (i + j) % 3; };
  const Land scene({base, file_});
  std::mt19937_64 random(test_seed(1));
  Points points = random_points({800, 904, 1720, 1600}, 4000, random);
  for (const auto& p : {cells(true, {0, 0.5}), cells(false, {0, 0.5})})
    points.x.insert(points.x.end(), p.x.begin(), p.x.end()),
        points.y.insert(points.y.end(), p.y.begin(), p.y.end());
  for (const double error : kErrors)
    for (const BlendOptions& options : all_blends()) {
      const Answers a = evaluate(scene.db(), error, points, options);
      for (std::size_t k = 0; k < points.size(); ++k) {
        ASSERT_NE(a.source[k], 0) << name_of(options) << " error " << error << " at " << points.x[k] << " "
                                  << points.y[k];
        ASSERT_TRUE(a.height[k] > 85 && a.height[k] < 115) << a.height[k];
        ASSERT_GT(a.source[k], 0) << "the base is real everywhere: " << name_of(options) << " error "
                                  << error;
      }
    }
}

TEST_P(NodataEdges, ARotatedGridAnswersInsideItsValidCells) {
  file_.geotransform = rotated(800, 1600, 29, kStep, kStep);
  frame_ = frame_of(file_);
  const Land scene({file_});
  const Points points = cells(true, {1e-9, 0.5, 1 - 1e-9});
  for (const double error : kErrors) {
    const Answers a = evaluate(scene.db(), error, points);
    for (std::size_t k = 0; k < points.size(); ++k) ASSERT_NE(a.source[k], 0) << "error " << error;
  }
}

INSTANTIATE_TEST_SUITE_P(Patterns, NodataEdges, ::testing::ValuesIn(kPatterns),
                         [](const auto& p) { return std::string(p.param.name); });

TEST(NodataValues, WhateverMeansNoDataTheHeightsAreTheSame) {
  const IsHole hole = kPatterns[1].at;
  std::vector<Answers> answers;
  Points points;
  for (int k = 0; k < 5000; ++k) points.add(810 + 0.17 * k, 1590 - 0.131 * k);
  for (const double nodata : {-9999.0, 1e30, -3.4e38, double(NAN)}) {
    const Land scene({with_holes(hole, nodata)});
    answers.push_back(evaluate(scene.db(), 1, points, {.smoothness = 2}));
  }
  for (const Answers& a : answers)
    EXPECT_EQ(std::memcmp(a.height.data(), answers[0].height.data(), 40000), 0);
  GridFile whole = with_holes([](int, int) { return false; }, -9999);
  const Answers without = evaluate(Land({whole}).db(), 1, points, {.smoothness = 2});
  EXPECT_NE(std::memcmp(without.height.data(), answers[0].height.data(), 40000), 0)
      << "negative control: holes matter";
}

}  // namespace
}  // namespace patchwork
