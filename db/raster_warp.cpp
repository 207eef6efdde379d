// A grid brought into another CRS: bilinear samples of the source on a grid of the source's own orientation.
// GDAL and PROJ transform the positions. The heights are interpolated here, and never across missing samples:
// GDAL's warper would spread the valid neighbours over a hole's rim.
//
//   affine fit of the transformed lattice -> axes, steps; transformed border -> size
//   for each destination row: transform it back, interpolate the source
//   cost = largest difference of the two bilinear surfaces at the vertices of one and the half lattice of the
//   other
#include <fcntl.h>
#include <gdal_alg.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "db/raster_impl.h"

namespace patchwork::raster_impl {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Samples of 8 bytes that are kept in memory; more go to a temporary file.
constexpr std::size_t kBytesInMemory = std::size_t{256} << 20;
// Positions are interpolated along a row where that errs by less than this, in pixels; the rest PROJ
// computes.
constexpr double kPositionError = 1e-3;
// A point this far outside the samples, in cells, is the rounding of one on the border.
constexpr double kBorderSlack = 0.02;
// A destination larger than this many times the source has been torn or folded by the projection.
constexpr double kMaxGrowth = 8;

// width x height doubles that need not fit into memory.
class Samples {
 public:
  Samples(int columns, int rows, const std::string& where)
      : width(columns),
        height(rows),
        bytes_(sizeof(double) * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    const bool small = bytes_ <= kBytesInMemory;
    const int file = small ? -1 : temporary_file(bytes_, where);
    void* const at = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE,
                          small ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_SHARED, file, 0);
    if (file >= 0) close(file);
    if (at == MAP_FAILED)
      throw Error(where, "there is no memory to warp it in", "warp it first, e.g. with gdalwarp");
    data_ = static_cast<double*>(at);
  }
  ~Samples() { munmap(data_, bytes_); }
  Samples(const Samples&) = delete;
  Samples& operator=(const Samples&) = delete;

  double* row(int j) { return data_ + static_cast<std::size_t>(j) * static_cast<std::size_t>(width); }
  const double* row(int j) const { return const_cast<Samples*>(this)->row(j); }

  const int width, height;

 private:
  // Unlinked at once, so that nothing remains however the process ends. Room is reserved before it is mapped:
  // a full disk met while writing to the mapping would be a signal and not an error.
  static int temporary_file(std::size_t bytes, const std::string& where) {
    std::error_code no_directory;  // then the name fails below, with the advice that helps
    std::string name = (std::filesystem::temp_directory_path(no_directory) / "patchwork-XXXXXX").string();
    const int file = no_directory ? -1 : mkstemp(name.data());
    if (file >= 0) unlink(name.c_str());
    if (file < 0 || posix_fallocate(file, 0, static_cast<off_t>(bytes)) != 0) {
      if (file >= 0) close(file);
      throw Error(where, "there is no room for " + std::to_string(bytes >> 20) + " MB of temporary samples",
                  "set TMPDIR to a larger disk, or warp it first, e.g. with gdalwarp");
    }
    return file;
  }

  std::size_t bytes_;
  double* data_ = nullptr;
};

// A sample of less weight than this is not needed: the point lies on the others, but for rounding.
constexpr double kNegligible = 1e-6;

double without_negligible(const double (&weights)[4], const double (&heights)[4]) {
  double sum = 0, total = 0;
  for (int k = 0; k < 4; ++k)
    if (std::abs(weights[k]) > kNegligible) {
      sum += weights[k] * heights[k];
      total += weights[k];
    }
  return sum / total;
}

// The bilinear surface at lattice point (u, v), up to `reach` cells outside linearly; NaN where a sample it
// needs is missing.
double surface(const Samples& s, double u, double v, double reach) {
  if (!(u >= -reach && v >= -reach && u <= s.width - 1 + reach && v <= s.height - 1 + reach)) return kNaN;
  const int i = std::clamp(static_cast<int>(u), 0, s.width - 2),
            j = std::clamp(static_cast<int>(v), 0, s.height - 2);
  const double a = u - i, b = v - j;
  const double *const p = s.row(j) + i, *const q = s.row(j + 1) + i;
  const double h = (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * q[0] + a * q[1]);
  if (!std::isnan(h)) return h;
  return without_negligible({(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b}, {p[0], p[1], q[0], q[1]});
}

// Pixels of one grid to pixels of another (or to a CRS, where its geotransform is none), and back.
class Transform {
 public:
  Transform(const RawGrid& source, const OGRSpatialReference& target, const std::array<double, 6>& target_gt,
            double error) {
    const GdalMessages messages;
    auto from = *source.crs, to = target;
    // Longitudes come back near the grid's own, also where it lies across the antimeridian or runs to 360.
    CPLStringList options;
    const auto& gt = source.geotransform;
    if (from.IsGeographic())
      options.SetNameValue(
          "CENTER_LONG", std::to_string(gt[0] + (gt[1] * source.width + gt[2] * source.height) / 2).c_str());
    void* const exact = GDALCreateGenImgProjTransformer4(
        OGRSpatialReference::ToHandle(&from), source.geotransform.data(), OGRSpatialReference::ToHandle(&to),
        target_gt.data(), options.List());
    if (!exact)
      throw Error(source.path,
                  messages.explain("cannot be transformed from " + crs_label(from) + " to " + crs_label(to)),
                  "give the right --crs, or warp it first");
    state_ = GDALCreateApproxTransformer(GDALGenImgProjTransform, exact, error);
    GDALApproxTransformerOwnsSubtransformer(state_, TRUE);
  }
  ~Transform() { GDALDestroyApproxTransformer(state_); }
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;

  // In place; a point that has no image becomes NaN. Points of equal y in a row go fastest.
  void apply(std::vector<double>& x, std::vector<double>& y, bool back) {
    const GdalMessages messages;
    const std::size_t n = x.size();
    z_.assign(n, 0);
    good_.assign(n, 0);
    GDALApproxTransform(state_, back, static_cast<int>(n), x.data(), y.data(), z_.data(), good_.data());
    for (std::size_t k = 0; k < n; ++k)
      if (!good_[k] || !std::isfinite(x[k]) || !std::isfinite(y[k])) x[k] = y[k] = kNaN;
  }

 private:
  void* state_;
  std::vector<double> z_;
  std::vector<int> good_;
};

constexpr std::array<double, 6> kNoGeotransform{0, 1, 0, 0, 0, 1};

[[noreturn]] void refuse_torn(const RawGrid& source, const OGRSpatialReference& target) {
  throw Error(source.path, "reaches beyond what " + crs_label(target) + " can show",
              "cut it into smaller pieces, or choose another CRS for the database");
}

// Least squares of the transformed positions over a regular lattice of the grid: centre and mean axes.
struct Fit {
  Point centre, along_i, along_j;
};

// Transformed back, the n x n positions over the grid are what they were: nothing is folded or torn.
bool comes_back(Transform& transform, const RawGrid& source, std::vector<double> x, std::vector<double> y) {
  const auto n = static_cast<int>(std::lround(std::sqrt(x.size())));
  transform.apply(x, y, true);
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a) {
      const auto k = static_cast<std::size_t>(b * n + a);
      const double u = source.width * double(a) / (n - 1), v = source.height * double(b) / (n - 1);
      if (!(std::hypot(x[k] - u, y[k] - v) < 0.1)) return false;
    }
  return true;
}

Fit fit(const RawGrid& source, const OGRSpatialReference& target) {
  constexpr int n = 17;
  Transform transform(source, target, kNoGeotransform, 0);
  std::vector<double> x, y;
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a) {
      x.push_back(source.width * double(a) / (n - 1));
      y.push_back(source.height * double(b) / (n - 1));
    }
  transform.apply(x, y, false);
  if (!comes_back(transform, source, x, y)) refuse_torn(source, target);
  Fit f;
  double squares = 0;
  for (int b = 0; b < n; ++b)
    for (int a = 0; a < n; ++a) {
      const auto k = static_cast<std::size_t>(b * n + a);
      const double s = double(a) / (n - 1) - 0.5, t = double(b) / (n - 1) - 0.5;
      f.centre = {f.centre.x + x[k] / (n * n), f.centre.y + y[k] / (n * n)};
      f.along_i = {f.along_i.x + s * x[k], f.along_i.y + s * y[k]};
      f.along_j = {f.along_j.x + t * x[k], f.along_j.y + t * y[k]};
      squares += s * s;
    }
  f.along_i = {f.along_i.x / (squares * source.width), f.along_i.y / (squares * source.width)};
  f.along_j = {f.along_j.x / (squares * source.height), f.along_j.y / (squares * source.height)};
  return f;
}

// An orthogonal lattice as near to the fit as can be: both axes give way by the same angle.
std::array<double, 6> oriented(const Fit& f) {
  const double turn = f.along_i.x * f.along_j.y - f.along_i.y * f.along_j.x < 0 ? -1 : 1;
  const double si = std::hypot(f.along_i.x, f.along_i.y), sj = std::hypot(f.along_j.x, f.along_j.y);
  // j turned back by a right angle ought to be i; the sum of the two unit vectors halves the angle between.
  const double ex = f.along_i.x / si + turn * f.along_j.y / sj,
               ey = f.along_i.y / si - turn * f.along_j.x / sj;
  const double c = ex / std::hypot(ex, ey), s = ey / std::hypot(ex, ey);
  return {f.centre.x, c * si, -turn * s * sj, f.centre.y, s * si, turn * c * sj};
}

// The footprint's border in pixels: pixel edges, or the outer samples where pixels are points.
void border(const RawGrid& source, std::vector<double>& x, std::vector<double>& y) {
  const double inset = source.pixel_is_area ? 0 : 0.5;
  const double x0 = inset, x1 = source.width - inset, y0 = inset, y1 = source.height - inset;
  constexpr int n = 1024;
  for (int k = 0; k <= n; ++k) {
    const double t = double(k) / n, u = x0 + (x1 - x0) * t, v = y0 + (y1 - y0) * t;
    x.insert(x.end(), {u, u, x0, x1});
    y.insert(y.end(), {y0, y1, v, v});
  }
}

// Puts the corner and the size so that the whole border is inside, with equal margins on opposite sides.
void enclose(const RawGrid& source, const OGRSpatialReference& target, WarpedGrid& out) {
  std::vector<double> x, y;
  border(source, x, y);
  Transform(source, target, kNoGeotransform, 0).apply(x, y, false);
  const auto axes = out.geotransform;
  const Frame lattice = Frame::from_geotransform(axes, source.path);
  double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Point p = lattice.to_lattice(x[k], y[k]);
    if (!std::isfinite(p.x + p.y)) refuse_torn(source, target);
    lo[0] = std::min(lo[0], p.x), hi[0] = std::max(hi[0], p.x);
    lo[1] = std::min(lo[1], p.y), hi[1] = std::max(hi[1], p.y);
  }
  double cells[2], first[2];
  for (const int a : {0, 1}) {
    constexpr double kRounding = 1e-6;
    cells[a] = std::ceil(hi[a] - lo[a] - kRounding) + (source.pixel_is_area ? 0 : 1);
    first[a] = (lo[a] + hi[a] - cells[a] + 1) / 2;  // lattice coordinate of the first sample
  }
  if (!(cells[0] * cells[1] <= kMaxGrowth * (double(source.width) * source.height + 64)))
    refuse_torn(source, target);
  out.width = std::max(2, static_cast<int>(cells[0]));
  out.height = std::max(2, static_cast<int>(cells[1]));
  out.geotransform[0] += axes[1] * first[0] + axes[2] * first[1];
  out.geotransform[3] += axes[4] * first[0] + axes[5] * first[1];
}

void resample(const RawGrid& source, Transform& transform, const Samples& from, Samples& to) {
  const double reach = (source.pixel_is_area ? 0.5 : 0) + kBorderSlack;
  std::vector<double> x(static_cast<std::size_t>(to.width)), y(x.size());
  for (int j = 0; j < to.height; ++j) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i) + 0.5, y[i] = j + 0.5;
    transform.apply(x, y, true);
    for (std::size_t i = 0; i < x.size(); ++i) to.row(j)[i] = surface(from, x[i] - 0.5, y[i] - 0.5, reach);
  }
}

// Notes the differences of the surfaces of `a` and `b` at the points of `a`'s lattice divided by `parts`, by
// their place in the destination: `b`'s lattice, or with `back` `a`'s.
void note_differences(const Samples& a, const Samples& b, Transform& transform, bool back, int parts,
                      CostField& cost) {
  std::vector<double> x(static_cast<std::size_t>((a.width - 1) * parts + 1)), y(x.size());
  const double reach = back ? 0.5 : 0;
  for (int j = 0; j <= (a.height - 1) * parts; ++j) {
    const double v = double(j) / parts;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i) / parts + 0.5, y[i] = v + 0.5;
    transform.apply(x, y, back);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double d = std::abs(surface(a, static_cast<double>(i) / parts, v, 0) -
                                surface(b, x[i] - 0.5, y[i] - 0.5, reach));
      if (d > 0) back ? cost.note(double(i) / parts, v, d) : cost.note(x[i] - 0.5, y[i] - 0.5, d);
    }
  }
}

std::unique_ptr<Samples> load(const RawGrid& source) {
  auto samples = std::make_unique<Samples>(source.width, source.height, source.path);
  const int band = std::max(1, (1 << 20) / source.width);
  for (int j = 0; j < source.height; j += band)
    source.rows->read(j, std::min(band, source.height - j), samples->row(j));
  return samples;
}

bool any_cell(const Samples& s) {
  for (int j = 0; j + 1 < s.height; ++j) {
    const double *const p = s.row(j), *const q = s.row(j + 1);
    for (int i = 0; i + 1 < s.width; ++i)
      if (!std::isnan(p[i] + p[i + 1] + q[i] + q[i + 1])) return true;
  }
  return false;
}

class SampleRows final : public Rows {
 public:
  explicit SampleRows(std::unique_ptr<Samples> samples) : samples_(std::move(samples)) {}
  void read(int row, int rows, double* out) override {
    std::copy_n(samples_->row(row),
                static_cast<std::size_t>(rows) * static_cast<std::size_t>(samples_->width), out);
  }
  void read(int row, int rows, float* out) override {
    const double* const from = samples_->row(row);
    const auto count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(samples_->width);
    std::transform(from, from + count, out, [](double v) { return static_cast<float>(v); });
  }

 private:
  std::unique_ptr<Samples> samples_;
};

}  // namespace

WarpedGrid warp(const RawGrid& source, const OGRSpatialReference& target) {
  WarpedGrid out;
  out.geotransform = oriented(fit(source, target));
  enclose(source, target, out);
  const auto from = load(source);
  auto to = std::make_unique<Samples>(out.width, out.height, source.path);
  Transform transform(source, target, out.geotransform, kPositionError);
  resample(source, transform, *from, *to);
  if (any_cell(*from) && !any_cell(*to))
    throw Error(source.path, "is too small to be warped to " + crs_label(target),
                "choose its CRS for the database");
  // Positions are ten times as exact here, so that their own error is part of what is measured.
  Transform finer(source, target, out.geotransform, kPositionError / 10);
  out.cost = CostField(out.width, out.height);
  note_differences(*from, *to, finer, false, 1, out.cost);
  note_differences(*to, *from, finer, true, 2, out.cost);
  out.rows = std::make_unique<SampleRows>(std::move(to));
  return out;
}

}  // namespace patchwork::raster_impl
