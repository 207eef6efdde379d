#include "tools/raster_field.h"

#include <cpl_error.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <vector>

#include "db/error.h"

namespace patchwork {

namespace {

using Transform = std::unique_ptr<OGRCoordinateTransformation>;

// Weights of four samples at -1, 0, 1, 2 for the Hermite cubic with central differences (Catmull and Rom).
struct CubicWeights {
  double w[4];
  explicit CubicWeights(double t)
      : w{0.5 * t * (t * (2 - t) - 1), 0.5 * (t * t * (3 * t - 5) + 2), 0.5 * t * (t * (4 - 3 * t) + 1),
          0.5 * t * t * (t - 1)} {}
};

// The heights over their own lattice: x, y are i, j.
class LatticeField : public HeightField {
 public:
  int width = 0, height = 0;
  std::vector<double> samples;

  double sample(int i, int j) const {
    i = std::clamp(i, 0, width - 1), j = std::clamp(j, 0, height - 1);
    return samples[std::size_t(j) * std::size_t(width) + std::size_t(i)];
  }
  double at(double i, double j) const {
    i = std::clamp(i, 0., width - 1.), j = std::clamp(j, 0., height - 1.);
    const int i0 = std::min(int(i), width - 2), j0 = std::min(int(j), height - 2);
    const CubicWeights wi(i - i0), wj(j - j0);
    double sum = 0;
    for (int b = 0; b < 4; ++b)
      for (int a = 0; a < 4; ++a) sum += wj.w[b] * wi.w[a] * sample(i0 - 1 + a, j0 - 1 + b);
    return sum;
  }
  void heights(std::span<const double> x, std::span<const double> y, std::span<double> out) const override {
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = at(x[k], y[k]);
  }
};

LatticeField read_lattice(GDALDataset& file, const std::string& path) {
  GDALRasterBand* band = file.GetRasterBand(1);
  LatticeField lattice;
  lattice.width = file.GetRasterXSize(), lattice.height = file.GetRasterYSize();
  if (band == nullptr || lattice.width < 2 || lattice.height < 2)
    throw Error(path, "it is smaller than 2 x 2 samples", "give a height grid");
  lattice.samples.resize(std::size_t(lattice.width) * std::size_t(lattice.height));
  if (band->RasterIO(GF_Read, 0, 0, lattice.width, lattice.height, lattice.samples.data(), lattice.width,
                     lattice.height, GDT_Float64, 0, 0, nullptr) != CE_None)
    throw Error(path, "its heights cannot be read", CPLGetLastErrorMsg());
  int has_nodata = 0;
  const double nodata = band->GetNoDataValue(&has_nodata), scale = band->GetScale(),
               offset = band->GetOffset();
  for (double& h : lattice.samples) {
    if (!std::isfinite(h) || (has_nodata && h == nodata))
      throw Error(path, "it has voids", "fill them first, e.g. with gdal_fillnodata.py");
    h = h * scale + offset;
  }
  return lattice;
}

// Longitude first on both sides, as geotransforms have it, whatever the authorities say. Null: none is
// needed.
Transform make_transform(const OGRSpatialReference* file_crs, const std::string& crs,
                         const std::string& path) {
  if (crs.empty()) return nullptr;
  OGRSpatialReference wanted;
  if (wanted.SetFromUserInput(crs.c_str()) != OGRERR_NONE)
    throw Error(crs, "it names no coordinate system", "try EPSG:n");
  if (file_crs == nullptr) return nullptr;
  wanted.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  OGRSpatialReference own(*file_crs);
  own.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  Transform transform(OGRCreateCoordinateTransformation(&wanted, &own));
  if (!transform) throw Error(path, "no way leads from " + crs + " to its coordinate system");
  return transform;
}

}  // namespace

struct RasterField::Impl {
  LatticeField lattice;
  Frame frame;  // lattice to the file's CRS
  std::string path;
  double detail;
  NoiseOctave coarse, fine;

  Transform to_file;  // null where both CRSs are one
  mutable std::mutex cloning;
  mutable tbb::enumerable_thread_specific<Transform> clones;

  // A transformation serves one thread at a time.
  OGRCoordinateTransformation& own_transform() const {
    Transform& mine = clones.local();
    if (!mine) {
      const std::lock_guard<std::mutex> lock(cloning);
      mine.reset(to_file->Clone());
    }
    return *mine;
  }
};

RasterField::~RasterField() = default;

RasterField::RasterField(const std::string& path, const RasterFieldOptions& options)
    : impl_(std::make_unique<Impl>()) {
  GDALAllRegister();
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);  // what fails is thrown, not printed as well
  const std::unique_ptr<GDALDataset> file(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (!file) throw Error(path, "it cannot be opened", CPLGetLastErrorMsg());
  std::array<double, 6> gt{};
  if (file->GetGeoTransform(gt.data()) != CE_None)
    throw Error(path, "it has no geotransform", "georeference it first");
  impl_->path = path;
  impl_->lattice = read_lattice(*file, path);
  impl_->frame = Frame::from_geotransform(gt, path);
  impl_->to_file = make_transform(file->GetSpatialRef(), options.crs, path);
  impl_->detail = options.detail;
  impl_->coarse = {1 / 60., hash_lattice(0, 11, options.seed)};
  impl_->fine = {1 / 25., hash_lattice(1, 11, options.seed)};
}

void RasterField::heights(std::span<const double> x, std::span<const double> y, std::span<double> out) const {
  std::vector<double> px(x.begin(), x.end()), py(y.begin(), y.end()), coarse(x.size()), fine(x.size());
  // A point that the projection cannot place comes back infinite: it is told, not guessed.
  if (impl_->to_file && !impl_->own_transform().Transform(int(px.size()), px.data(), py.data()))
    throw Error(impl_->path, "a point does not exist in its coordinate system", "check --crs and --survey");
  impl_->coarse.values(x, y, coarse);
  impl_->fine.values(x, y, fine);
  for (std::size_t k = 0; k < out.size(); ++k) {
    const Point p = impl_->frame.to_lattice(px[k], py[k]);
    out[k] = impl_->lattice.at(p.x, p.y) + impl_->detail * (0.7 * coarse[k] + 0.3 * fine[k]);
  }
}

Extent RasterField::extent() const {
  // A projected outline bends: its corners alone would miss the extremes.
  constexpr int kSteps = 64;
  std::vector<double> x, y;
  const double w = impl_->lattice.width - 1, h = impl_->lattice.height - 1;
  for (int s = 0; s <= kSteps; ++s) {
    const double t = double(s) / kSteps;
    for (const Point at : {Point{t * w, 0}, Point{t * w, h}, Point{0, t * h}, Point{w, t * h}}) {
      const Point p = impl_->frame.to_domain(at.x, at.y);
      x.push_back(p.x), y.push_back(p.y);
    }
  }
  if (impl_->to_file) {
    const Transform inverse(impl_->to_file->GetInverse());
    if (!inverse || !inverse->Transform(int(x.size()), x.data(), y.data()))
      throw Error(impl_->path, "its outline does not exist in the wanted coordinate system", "check --crs");
  }
  const auto [xmin, xmax] = std::minmax_element(x.begin(), x.end());
  const auto [ymin, ymax] = std::minmax_element(y.begin(), y.end());
  return {*xmin, *ymin, *xmax, *ymax};
}

double RasterField::source_accuracy() const {
  const LatticeField& lattice = impl_->lattice;
  return interpolation_error(lattice, Frame(), lattice.width, lattice.height) + impl_->detail;
}

}  // namespace patchwork
