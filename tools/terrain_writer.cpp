#include "tools/terrain_writer.h"

#include <cpl_error.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "db/error.h"

namespace patchwork {

namespace {

constexpr std::size_t kBandSamples = std::size_t{4} << 20;  // held in memory at once
constexpr int kHoleBlock = 32;                              // samples; each block has at most one round hole
constexpr double kHoleShare = 0.2986;  // of a block that its hole takes on average: radii 2 to 16, uniform

// Which samples a plan leaves without data.
class Holes {
 public:
  Holes(double share, std::uint32_t seed)
      : round_(0.9 * share / kHoleShare), single_(0.1 * share), seed_(hash_lattice(0, 21, seed)) {}

  bool at(int i, int j) const { return single_ > 0 && (in_round(i, j) || hash_unit(i, j, seed_) < single_); }

 private:
  // A disc somewhere inside its block, so that a sample asks one block only.
  bool in_round(int i, int j) const {
    const int bi = i / kHoleBlock, bj = j / kHoleBlock;
    if (hash_unit(bi, bj, seed_ + 1) >= round_) return false;
    const double radius = 2 + 14 * hash_unit(bi, bj, seed_ + 2), room = kHoleBlock - 2 * radius;
    const double dx = i - bi * kHoleBlock - radius - room * hash_unit(bi, bj, seed_ + 3);
    const double dy = j - bj * kHoleBlock - radius - room * hash_unit(bi, bj, seed_ + 4);
    return dx * dx + dy * dy < radius * radius;
  }

  double round_, single_;
  std::uint32_t seed_;
};

// Four uniform numbers' sum, scaled to (-1, 1): bell-shaped and bounded by construction.
double bell(int i, int j, std::uint32_t seed) {
  double sum = -2;
  for (std::uint32_t k = 0; k < 4; ++k) sum += hash_unit(i, j, seed + k);
  return sum / 2;
}

// What one row adds to the facts.
struct RowRange {
  double lowest = INFINITY, highest = -INFINITY;
  long long voids = 0;
};

// A stored type: its GDAL name, its nodata, and the codes that heights may take.
template <class T>
struct Storage {
  static constexpr bool kInteger = std::numeric_limits<T>::is_integer;
  static constexpr GDALDataType kType = !kInteger             ? GDT_Float32
                                        : sizeof(T) == 4      ? GDT_Int32
                                        : std::is_signed_v<T> ? GDT_Int16
                                                              : GDT_UInt16;
  // -9999 lies below all terrain; integers give up their outermost code.
  static constexpr T kNodata = !kInteger             ? T(-9999)
                               : std::is_signed_v<T> ? std::numeric_limits<T>::min()
                                                     : std::numeric_limits<T>::max();
};

template <class T>
class Survey {
 public:
  Survey(const HeightField& field, const SurveyPlan& plan, double quantum, const std::string& path)
      : field_(field),
        plan_(plan),
        quantum_(quantum),
        path_(path),
        holes_(plan.holes, plan.seed),
        noise_seed_(hash_lattice(1, 21, plan.seed)) {}

  // Band by band: memory does not grow with the file.
  SurveyFacts write(GDALDataset& file) {
    const int rows = int(std::clamp<std::size_t>(kBandSamples / std::size_t(plan_.width), 1, 4096));
    std::vector<T> codes(std::size_t(std::min(rows, plan_.height)) * std::size_t(plan_.width));
    SurveyFacts facts{.lowest = INFINITY, .highest = -INFINITY};
    for (int start = 0; start < plan_.height; start += rows) {
      const int count = std::min(rows, plan_.height - start);
      fill(start, count, codes, facts);
      if (file.GetRasterBand(1)->RasterIO(GF_Write, 0, start, plan_.width, count, codes.data(), plan_.width,
                                          count, Storage<T>::kType, 0, 0, nullptr) != CE_None)
        throw Error(path_, "it cannot be written", CPLGetLastErrorMsg());
    }
    if (facts.lowest > facts.highest) facts.lowest = facts.highest = 0;
    const double largest = std::max(std::abs(facts.lowest), std::abs(facts.highest));
    facts.rounding = Storage<T>::kInteger ? quantum_ / 2 : largest * 0x1p-24;
    return facts;
  }

 private:
  void fill(int start, int count, std::vector<T>& codes, SurveyFacts& facts) const {
    std::vector<RowRange> ranges(std::size_t(count), RowRange{});
    tbb::parallel_for(0, count, [&](int r) {
      T* row = codes.data() + std::size_t(r) * std::size_t(plan_.width);
      ranges[std::size_t(r)] = fill_row(start + r, row);
    });
    for (const RowRange& r : ranges) {
      facts.lowest = std::min(facts.lowest, r.lowest), facts.highest = std::max(facts.highest, r.highest);
      facts.voids += r.voids;
    }
  }

  // Positions are evaluated as Frame::to_domain does, so that they agree with a reader's to the last bits.
  RowRange fill_row(int j, T* row) const {
    const auto& g = plan_.geotransform;
    std::vector<double> x(std::size_t(plan_.width), 0.), y = x, h = x;
    for (int i = 0; i < plan_.width; ++i) {
      x[std::size_t(i)] = g[0] + (g[1] * i + g[2] * j);
      y[std::size_t(i)] = g[3] + (g[4] * i + g[5] * j);
    }
    field_.heights(x, y, h);
    RowRange range;
    for (int i = 0; i < plan_.width; ++i) {
      if (holes_.at(i, j)) {
        row[i] = Storage<T>::kNodata, ++range.voids;
        continue;
      }
      const double height = h[std::size_t(i)] + (plan_.noise > 0 ? plan_.noise * bell(i, j, noise_seed_) : 0);
      row[i] = encode(height);
      range.lowest = std::min(range.lowest, height), range.highest = std::max(range.highest, height);
    }
    return range;
  }

  // A height that does not fit is refused: a clipped sample would belie the stated accuracy.
  T encode(double height) const {
    if constexpr (!Storage<T>::kInteger) return T(height);
    const double code = std::floor(height / quantum_ + 0.5);
    constexpr auto low = double(std::numeric_limits<T>::min()), high = double(std::numeric_limits<T>::max());
    if (!(code >= low && code <= high) || T(code) == Storage<T>::kNodata)
      throw Error(path_, "a height of " + std::to_string(height) + " m does not fit its type",
                  "give a larger --scale or another --type");
    return T(code);
  }

  const HeightField& field_;
  const SurveyPlan& plan_;
  double quantum_;
  const std::string& path_;
  Holes holes_;
  std::uint32_t noise_seed_;
};

// GDAL's geotransform is that of pixel corners, half a step before the vertices.
std::array<double, 6> corner_geotransform(std::array<double, 6> g) {
  g[0] -= 0.5 * g[1] + 0.5 * g[2], g[3] -= 0.5 * g[4] + 0.5 * g[5];
  return g;
}

std::unique_ptr<GDALDataset> create(const std::string& path, const SurveyPlan& plan, GDALDataType type,
                                    const std::string& crs) {
  GDALAllRegister();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  const char* options[] = {"BIGTIFF=IF_SAFER", nullptr};
  std::unique_ptr<GDALDataset> file(
      driver->Create(path.c_str(), plan.width, plan.height, 1, type, const_cast<char**>(options)));
  if (!file) throw Error(path, "it cannot be made", CPLGetLastErrorMsg());
  std::array<double, 6> corner = corner_geotransform(plan.geotransform);
  file->SetMetadataItem(GDALMD_AREA_OR_POINT, GDALMD_AOP_POINT);
  file->SetGeoTransform(corner.data());
  if (crs.empty()) return file;
  OGRSpatialReference reference;
  if (reference.SetFromUserInput(crs.c_str()) != OGRERR_NONE)
    throw Error(crs, "it names no coordinate system", "try EPSG:n");
  file->SetSpatialRef(&reference);
  return file;
}

template <class T>
SurveyFacts write_as(const HeightField& field, const SurveyPlan& plan, const SampleFormat& format,
                     const std::string& path) {
  const CPLErrorHandlerPusher quiet(CPLQuietErrorHandler);  // what fails is thrown, not printed as well
  const std::unique_ptr<GDALDataset> file = create(path, plan, Storage<T>::kType, format.crs);
  GDALRasterBand* band = file->GetRasterBand(1);
  band->SetNoDataValue(double(Storage<T>::kNodata));
  band->SetUnitType("m");
  if (Storage<T>::kInteger) band->SetScale(format.quantum);
  const SurveyFacts facts = Survey<T>(field, plan, format.quantum, path).write(*file);
  CPLErrorReset();
  file->FlushCache();
  if (CPLGetLastErrorType() >= CE_Failure) throw Error(path, "it cannot be written", CPLGetLastErrorMsg());
  return facts;
}

}  // namespace

std::array<double, 6> survey_geotransform(Point centre, int width, int height, double step, double angle) {
  const double c = step * std::cos(angle * std::numbers::pi / 180);
  const double s = step * std::sin(angle * std::numbers::pi / 180);
  const double i = 0.5 * (width - 1), j = 0.5 * (height - 1);
  return {centre.x - c * i + s * j, c, -s, centre.y + s * i + c * j, -s, -c};
}

SurveyFacts write_survey(const HeightField& field, const SurveyPlan& plan, const SampleFormat& format,
                         const std::string& path) {
  SurveyFacts facts;
  if (format.type == "Int16")
    facts = write_as<std::int16_t>(field, plan, format, path);
  else if (format.type == "UInt16")
    facts = write_as<std::uint16_t>(field, plan, format, path);
  else if (format.type == "Int32")
    facts = write_as<std::int32_t>(field, plan, format, path);
  else if (format.type == "Float32")
    facts = write_as<float>(field, plan, format, path);
  else
    throw Error(format.type, "it is no sample type", "give Int16, UInt16, Int32 or Float32");
  const Frame frame = Frame::from_geotransform(corner_geotransform(plan.geotransform), path);
  facts.interpolation_error = interpolation_error(field, frame, plan.width, plan.height);
  facts.accuracy = facts.interpolation_error + facts.rounding + plan.noise;
  return facts;
}

}  // namespace patchwork
