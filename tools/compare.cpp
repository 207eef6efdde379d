#include "tools/compare.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "blend/blend.h"
#include "query/extract.h"

namespace patchwork::cli {

namespace {

constexpr int kPointsAlong = 256;  // of the new grid, along each axis at most
constexpr int kIterations = 30;
constexpr double kTukey = 4.685;  // 95 % efficiency for normal errors
constexpr double kMadToSigma = 1.4826;

struct Pairs {
  std::vector<double> x, y, difference;
};

double median(std::vector<double> v) {
  const auto middle = v.begin() + std::ptrdiff_t(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

Pairs sample_both(const Database& db, const RasterSource& source) {
  const int w = source.width(), h = source.height();
  const int di = std::max(1, w / kPointsAlong), dj = std::max(1, h / kPointsAlong);
  std::vector<double> row(static_cast<size_t>(w)), x, y, z;
  for (int j = dj / 2; j < h; j += dj) {
    source.read_rows(j, 1, std::span<double>(row));
    for (int i = di / 2; i < w; i += di) {
      if (!std::isfinite(row[size_t(i)])) continue;
      const Point p = source.frame().to_domain(i, j);
      x.push_back(p.x), y.push_back(p.y), z.push_back(source.scale() * row[size_t(i)] + source.offset());
    }
  }
  const Extraction best = extract(db, {.error = 0});
  std::vector<double> there(x.size());
  Blend(db, best.patches, {}).at_points(x, y, {.height = there, .bound = {}, .source = {}, .patch = {}});
  Pairs pairs;
  for (std::size_t k = 0; k < x.size(); ++k)
    if (std::isfinite(there[k]))
      pairs.x.push_back(x[k]), pairs.y.push_back(y[k]), pairs.difference.push_back(z[k] - there[k]);
  return pairs;
}

}  // namespace

// Iteratively reweighted least squares with Tukey's biweight, from the median, on centred and scaled
// coordinates.
std::optional<Comparison> compare(const Database& db, const RasterSource& source) {
  const Pairs p = sample_both(db, source);
  const auto n = Eigen::Index(p.x.size());
  if (n < 3) return std::nullopt;
  const Eigen::Map<const Eigen::VectorXd> x(p.x.data(), n), y(p.y.data(), n), d(p.difference.data(), n);
  const double cx = x.mean(), cy = y.mean();
  const double scale = std::max({(x.array() - cx).abs().maxCoeff(), (y.array() - cy).abs().maxCoeff(), 1e-9});
  Eigen::MatrixX3d a(n, 3);
  a.col(0).setOnes(), a.col(1) = (x.array() - cx) / scale, a.col(2) = (y.array() - cy) / scale;
  Eigen::Vector3d fit(median(p.difference), 0, 0);
  double sigma = 0;
  for (int k = 0; k < kIterations; ++k) {
    const Eigen::VectorXd rest = d - a * fit;
    const Eigen::VectorXd size = rest.cwiseAbs();
    sigma = kMadToSigma * median({size.data(), size.data() + n});
    if (!(sigma > 0)) break;
    const Eigen::ArrayXd u = (rest.array() / (kTukey * sigma)).square();
    const Eigen::VectorXd weight = (u < 1).select((1 - u).square(), 0.0);
    const Eigen::Matrix3d normal = a.transpose() * weight.asDiagonal() * a;
    fit = normal.completeOrthogonalDecomposition().solve(a.transpose() * (weight.asDiagonal() * d));
  }
  return Comparison{fit[0], fit[1] / scale, fit[2] / scale, sigma, size_t(n)};
}

}  // namespace patchwork::cli
