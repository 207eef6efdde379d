#include "tools/bench/truth_check.h"

#include <gdal_priv.h>

#include <algorithm>
#include <cmath>

#include "db/error.h"

namespace patchwork::cli {

namespace {

constexpr int kRim = 16;

struct Rows {
  Rows(const std::string& path)
      : dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR)) {
    if (!dataset || dataset->GetGeoTransform(transform) != CE_None)
      throw Error(path, "it cannot be read as a raster");
    width = dataset->GetRasterXSize(), height = dataset->GetRasterYSize();
  }
  std::vector<float> read(int band, int row) {
    std::vector<float> samples(static_cast<size_t>(width));
    if (dataset->GetRasterBand(band)->RasterIO(GF_Read, 0, row, width, 1, samples.data(), width, 1,
                                               GDT_Float32, 0, 0, nullptr) != CE_None)
      throw Error(dataset->GetDescription(), "it ends early or is damaged");
    return samples;
  }
  GDALDatasetUniquePtr dataset;
  double transform[6];
  int width = 0, height = 0;
};

// Half a unit in the last place: what rounding to float32 may add to a distance.
double rounding(float height) {
  return 0.5 * double(std::nextafter(std::abs(height), INFINITY) - std::abs(height));
}

}  // namespace

Json TruthFigures::json() const { return {{"pixels", pixels}, {"rms", rms}, {"p99", p99}, {"max", max}}; }

TruthFigures compare_with_truth(const std::string& path, const HeightField& truth, int stride) {
  GDALAllRegister();
  Rows rows(path);
  const bool bounded = rows.dataset->GetRasterCount() > 1;
  TruthFigures figures;
  std::vector<double> distances, x, y, heights;
  for (int c = kRim; c < rows.width - kRim; c += stride)
    x.push_back(rows.transform[0] + (c + 0.5) * rows.transform[1]);
  y.resize(x.size()), heights.resize(x.size());
  double squares = 0;
  for (int r = kRim; r < rows.height - kRim; r += stride) {
    std::fill(y.begin(), y.end(), rows.transform[3] + (r + 0.5) * rows.transform[5]);
    truth.heights(x, y, heights);
    const std::vector<float> found = rows.read(1, r), bound = bounded ? rows.read(2, r) : found;
    for (std::size_t k = 0; k < x.size(); ++k) {
      const std::size_t c = kRim + k * size_t(stride);
      if (std::isnan(found[c])) continue;
      const double d = std::abs(double(found[c]) - heights[k]);
      distances.push_back(d), squares += d * d;
      figures.beyond_the_bound += bounded && d > double(bound[c]) + rounding(found[c]);
    }
  }
  if (distances.empty()) throw Error(path, "it holds no height to compare", "ask for a larger --size");
  std::sort(distances.begin(), distances.end());
  figures.pixels = distances.size();
  figures.rms = std::sqrt(squares / double(distances.size()));
  figures.p99 = distances[size_t(double(distances.size() - 1) * 0.99)], figures.max = distances.back();
  return figures;
}

}  // namespace patchwork::cli
