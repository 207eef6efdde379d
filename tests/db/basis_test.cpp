#include "db/basis.h"

#include <gtest/gtest.h>

#include <cmath>

namespace patchwork {
namespace {

template <int k>
double at(const double (&p)[4], double t) {
  const CellWeights w = cell_weights<k>(t);
  return p[1] + (w.before * (p[0] - p[1]) + w.far * (p[2] - p[1]) + w.beyond * (p[3] - p[1]));
}

TEST(Basis, InterpolatesBothEndsOfACell) {
  const double p[4] = {3, -7, 11, 40};
  EXPECT_EQ(at<0>(p, 0), -7);
  EXPECT_EQ(at<1>(p, 0), -7);
  EXPECT_EQ(at<2>(p, 0), -7);
  EXPECT_NEAR(at<1>(p, 1), 11, 1e-12);
  EXPECT_NEAR(at<2>(p, 1), 11, 1e-12);
}

TEST(Basis, ReproducesConstantsExactlyAndQuadraticsToRounding) {
  const double constant[4] = {0.1, 0.1, 0.1, 0.1}, square[4] = {1, 0, 1, 4};
  for (double t = 0; t <= 1; t += 1.0 / 64) {
    EXPECT_EQ(at<1>(constant, t), 0.1);
    EXPECT_EQ(at<2>(constant, t), 0.1);
    EXPECT_NEAR(at<1>(square, t), t * t, 1e-14);
    EXPECT_NEAR(at<2>(square, t), t * t, 1e-14);
  }
  EXPECT_GT(std::abs(at<0>(square, 0.5) - 0.25), 0.2);  // negative control: the linear one does not
}

// One-sided derivatives of the piecewise interpolant of samples at -1, 0, 1, 2, 3 around the joint at 1, from
// exact polynomials: a quintic through six points is differentiated by finite differences of high order.
template <int k>
double jump(int derivative) {
  const double f[6] = {2, -1, 4, 0.5, 3, -2};
  const double left[4] = {f[0], f[1], f[2], f[3]}, right[4] = {f[1], f[2], f[3], f[4]};
  const double h = 1e-3;
  const auto l = [&](int n) { return at<k>(left, 1 - n * h); };
  const auto r = [&](int n) { return at<k>(right, n * h); };
  if (derivative == 0) return std::abs(l(0) - r(0));
  if (derivative == 1)
    return std::abs((11 * l(0) - 18 * l(1) + 9 * l(2) - 2 * l(3)) / (6 * h) -
                    (-11 * r(0) + 18 * r(1) - 9 * r(2) + 2 * r(3)) / (6 * h));
  return std::abs((2 * l(0) - 5 * l(1) + 4 * l(2) - l(3)) / (h * h) -
                  (2 * r(0) - 5 * r(1) + 4 * r(2) - r(3)) / (h * h));
}

TEST(Basis, DerivativesUpToKAreContinuousAtAJointAndTheNextIsNot) {
  EXPECT_LT(jump<0>(0), 1e-12);
  EXPECT_GT(jump<0>(1), 0.1);
  EXPECT_LT(jump<1>(1), 1e-5);
  EXPECT_GT(jump<1>(2), 0.1);
  EXPECT_LT(jump<2>(1), 1e-5);
  EXPECT_LT(jump<2>(2), 1e-2);
}

TEST(Basis, StatedConstantsHold) {
  for (double t = 0; t <= 1; t += 1.0 / 1024) {
    for (const CellWeights w : {cell_weights<1>(t), cell_weights<2>(t)}) {
      EXPECT_LE(w.before, 0);
      EXPECT_LE(w.beyond, 0);
      // Against the linear interpolant only `before` and `beyond` multiply second differences.
      EXPECT_LE(-w.before - w.beyond, kDepartureFromLinear + 1e-15);
      const double near = 1 - w.before - w.far - w.beyond;
      EXPECT_LE(std::abs(near) + std::abs(w.far), kInnerWeights + 1e-15);
      EXPECT_LE(std::abs(w.before) + std::abs(w.beyond), kOuterWeights + 1e-15);
    }
    // Second derivatives of the parts that multiply the two second differences, by differences.
    const double h = 1e-4, s = std::min(std::max(t, h), 1 - h);
    const auto bend = [&](auto weight) { return (weight(s - h) - 2 * weight(s) + weight(s + h)) / (h * h); };
    const double cubic = std::abs(bend([](double u) { return cell_weights<1>(u).before; })) +
                         std::abs(bend([](double u) { return cell_weights<1>(u).beyond; }));
    const double quintic = std::abs(bend([](double u) { return cell_weights<2>(u).before; })) +
                           std::abs(bend([](double u) { return cell_weights<2>(u).beyond; }));
    EXPECT_LE(cubic, kSecondDerivative + 1e-5);
    EXPECT_LE(quintic, kSecondDerivative + 1e-5);
  }
}

}  // namespace
}  // namespace patchwork
