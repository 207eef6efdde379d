// Opening one file: everything that can be wrong with it, its place, units and nodata.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "db/raster_impl.h"

namespace patchwork::raster_impl {

namespace {

struct Unit {
  const char* name;
  double metres;
};
constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937.0;
// The first four are what --unit takes; the others are met in files.
constexpr Unit kUnits[] = {{"m", 1},
                           {"ft", kFoot},
                           {"us-ft", kSurveyFoot},
                           {"cm", 0.01},
                           {"metre", 1},
                           {"metres", 1},
                           {"meter", 1},
                           {"meters", 1},
                           {"foot", kFoot},
                           {"feet", kFoot},
                           {"international foot", kFoot},
                           {"us_ft", kSurveyFoot},
                           {"ftus", kSurveyFoot},
                           {"us survey foot", kSurveyFoot},
                           {"us survey feet", kSurveyFoot},
                           {"us foot", kSurveyFoot},
                           {"foot_us", kSurveyFoot},
                           {"survey foot", kSurveyFoot},
                           {"us-foot", kSurveyFoot},
                           {"centimetre", 0.01},
                           {"centimeter", 0.01},
                           {"centimetres", 0.01},
                           {"centimeters", 0.01},
                           {"dm", 0.1},
                           {"mm", 0.001},
                           {"km", 1000}};

std::optional<double> metres_per(const std::string& unit, std::size_t known = std::size(kUnits)) {
  for (std::size_t k = 0; k < known; ++k)
    if (EQUAL(unit.c_str(), kUnits[k].name)) return kUnits[k].metres;
  return std::nullopt;
}

std::optional<double> option_unit(const RasterOptions& options) {
  return options.unit ? metres_per(*options.unit, 4) : std::nullopt;
}

GDALDatasetUniquePtr open_dataset(const std::string& path) {
  const GdalMessages messages;
  // Rows of uncompressed TIFFs go past GDAL's block cache: 4097 x 4097 of 16 bits in 28 ms instead of 62.
  const CPLConfigOptionSetter direct("GTIFF_DIRECT_IO", "YES", true);
  GDALDatasetUniquePtr dataset(
      GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
  if (dataset) return dataset;
  VSIStatBufL status;
  if (VSIStatL(path.c_str(), &status) != 0) throw Error(path, "there is no such file", "check the name");
  throw Error(path, messages.explain("is not a raster that GDAL can read"), "check it with gdalinfo");
}

// A file's only band. An alpha band is no choice where GDAL takes it for the mask of the others.
int only_band(const std::string& path, GDALDataset& dataset) {
  std::vector<int> found;
  for (int b = 1; b <= dataset.GetRasterCount(); ++b) {
    const bool alpha = dataset.GetRasterBand(b)->GetColorInterpretation() == GCI_AlphaBand;
    if (!alpha || !(dataset.GetRasterBand(1)->GetMaskFlags() & GMF_ALPHA)) found.push_back(b);
  }
  if (found.size() > 1)
    throw Error(path, "has " + std::to_string(found.size()) + " bands", "choose the heights with --band");
  return found.empty() ? 1 : found.front();
}

int choose_band(const std::string& path, GDALDataset& dataset, const RasterOptions& options) {
  const int count = dataset.GetRasterCount();
  if (count < 1) {
    const char* const inner = CSLFetchNameValue(dataset.GetMetadata("SUBDATASETS"), "SUBDATASET_1_NAME");
    throw Error(path, "has no bands of its own",
                inner ? "name one of the grids in it, such as " + std::string(inner) : "it holds no heights");
  }
  const int band = options.band ? *options.band : only_band(path, dataset);
  if (band < 1 || band > count)
    throw Error(path, "has no band " + std::to_string(band), "it has bands 1 to " + std::to_string(count));
  return band;
}

void read_geotransform(GDALDataset& dataset, RawGrid& grid) {
  if (dataset.GetGeoTransform(grid.geotransform.data()) == CE_None) return;
  if (dataset.GetGCPCount() > 0)
    throw Error(grid.path, "is placed by ground control points only", "warp it first, e.g. with gdalwarp");
  grid.geotransform = {0, 1, 0, 0, 0, -1};
  grid.warnings.push_back("no georeference: pixels taken as metres, y down");
}

// What GDAL makes of a GeoTIFF that says how its pixels lie, and nothing of where.
bool is_nameless(const OGRSpatialReference& crs) {
  const char* const name = crs.GetName();
  return crs.IsLocal() && (!name || EQUAL(name, "unnamed"));
}

void read_crs(GDALDataset& dataset, const RasterOptions& options, RawGrid& grid) {
  if (options.crs)
    grid.crs = parse_crs(*options.crs, "--crs");
  else if (const auto* crs = dataset.GetSpatialRef(); crs && !crs->IsEmpty() && !is_nameless(*crs))
    grid.crs = *crs;
  if (!grid.crs) return;
  if (make_horizontal(*grid.crs)) grid.warnings.push_back("the vertical part of its CRS is left out");
  if (!grid.crs->IsProjected() && !grid.crs->IsGeographic() && !grid.crs->IsLocal())
    throw Error(grid.path, "its CRS " + crs_label(*grid.crs) + " has no horizontal plane",
                "set the right one, e.g. with gdal_edit.py -a_srs");
}

double file_unit(GDALDataset& dataset, GDALRasterBand& band, RawGrid& grid) {
  const std::string name = band.GetUnitType();
  const auto* crs = dataset.GetSpatialRef();
  if (name.empty()) return crs && crs->IsCompound() ? crs->GetTargetLinearUnits("VERT_CS", nullptr) : 1;
  const auto unit = metres_per(name);
  if (!unit)
    grid.warnings.push_back("its unit \"" + name + "\" is not known: taken as metres; or give --unit");
  return unit.value_or(1);
}

void read_heights(GDALDataset& dataset, GDALRasterBand& band, const RasterOptions& options, RawGrid& grid) {
  const auto given = option_unit(options);
  const double unit = given ? *given : file_unit(dataset, band, grid);
  grid.scale = band.GetScale() * unit;
  grid.offset = band.GetOffset() * unit + options.vertical_offset;
  if (!std::isfinite(grid.scale) || grid.scale == 0 || !std::isfinite(grid.offset))
    throw Error(grid.path, "its band has a scale of zero, or a scale or offset that is not finite",
                "correct it, e.g. with gdal_edit.py -scale -offset");
}

// `value` as a sample of `band` would hold it, if one can; drivers print float nodata with too few digits.
std::optional<double> as_sample(double value, GDALRasterBand& band) {
  if (std::isnan(value)) return std::nullopt;  // never a height, declared or not
  const GDALDataType type = is_signed_byte(band) ? GDT_Int16 : band.GetRasterDataType();
  if (type == GDT_Float32) {
    constexpr double largest = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(value, -largest, largest));
  }
  if (type == GDT_Float64) {
    constexpr double largest = std::numeric_limits<double>::max();
    return std::clamp(value, -largest, largest);
  }
  int clamped = FALSE, rounded = FALSE;
  const double sample = GDALAdjustValueToDataType(type, value, &clamped, &rounded);
  if (GDALDataTypeIsInteger(type) && (clamped || rounded)) return std::nullopt;
  return sample;
}

std::optional<double> declared_nodata(GDALRasterBand& band) {
  int declared = FALSE;
  double value = 0;
  switch (band.GetRasterDataType()) {
    case GDT_Int64:
      value = static_cast<double>(band.GetNoDataValueAsInt64(&declared));
      break;
    case GDT_UInt64:
      value = static_cast<double>(band.GetNoDataValueAsUInt64(&declared));
      break;
    default:
      value = band.GetNoDataValue(&declared);
  }
  return declared ? std::optional(value) : std::nullopt;
}

std::vector<double> nodata_of(GDALRasterBand& band, const RasterOptions& options) {
  std::vector<double> values = options.nodata, kept;
  if (const auto declared = declared_nodata(band)) values.push_back(*declared);
  for (const double value : values)
    if (const auto sample = as_sample(value, band)) kept.push_back(*sample);
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

// GDAL calls a block empty too that lies in a hole of the file system, as written zeros may.
bool every_block_is_in_the_file(GDALRasterBand& band) {
  int across = 0, down = 0;
  band.GetBlockSize(&across, &down);
  for (int y = 0; y * down < band.GetYSize(); ++y)
    for (int x = 0; x * across < band.GetXSize(); ++x) {
      const std::string name = "BLOCK_OFFSET_" + std::to_string(x) + "_" + std::to_string(y);
      if (!band.GetMetadataItem(name.c_str(), "TIFF")) return false;
    }
  return true;
}

// Blocks that were never written read as zeros where no nodata value is declared: heights that nobody
// measured.
void refuse_missing_blocks(GDALRasterBand& band, const RawGrid& grid) {
  if (declared_nodata(band) || !(band.GetMaskFlags() & GMF_ALL_VALID)) return;
  if (std::binary_search(grid.nodata.begin(), grid.nodata.end(), 0.0)) return;
  const int status =
      band.GetDataCoverageStatus(0, 0, grid.width, grid.height, GDAL_DATA_COVERAGE_STATUS_EMPTY, nullptr);
  if (status & GDAL_DATA_COVERAGE_STATUS_EMPTY && !every_block_is_in_the_file(band))
    throw Error(grid.path, "ends early or is damaged: parts of it were cut off or never written",
                "get the file again, or give --nodata 0 if its zeros mean no data");
}

// Raw formats hold nothing that a reader would miss, so GDAL fills what lies beyond a short file's end.
void refuse_short_raw_file(GDALDataset& dataset, const RawGrid& grid) {
  static constexpr const char* kRawDrivers[] = {"ENVI", "EHdr", "GenBin", "ISCE", "ROI_PAC", "KRO", "MFF"};
  const std::string driver = dataset.GetDriverName();
  if (std::find(std::begin(kRawDrivers), std::end(kRawDrivers), driver) == std::end(kRawDrivers)) return;
  VSIStatBufL status;
  double bits = 0;
  for (int b = 1; b <= dataset.GetRasterCount(); ++b) {
    const char* const packed = dataset.GetRasterBand(b)->GetMetadataItem("NBITS", "IMAGE_STRUCTURE");
    bits +=
        packed ? std::atoi(packed) : GDALGetDataTypeSizeBits(dataset.GetRasterBand(b)->GetRasterDataType());
  }
  const double bytes = std::floor(bits / 8 * grid.width * grid.height);
  if (VSIStatL(grid.path.c_str(), &status) == 0 && static_cast<double>(status.st_size) < bytes)
    throw Error(grid.path, "ends early: it is shorter than its header says", "get the file again");
}

}  // namespace

void check_options(const RasterOptions& options) {
  if (options.accuracy && !(std::isfinite(*options.accuracy) && *options.accuracy >= 0))
    throw Error("--accuracy", "accuracy must be a number of metres >= 0",
                "give the vertical error of the heights");
  if (!std::isfinite(options.vertical_offset))
    throw Error("--vertical-offset", "must be a finite number of metres");
  if (options.unit && !option_unit(options))
    throw Error("--unit", "\"" + *options.unit + "\" is not a unit", "use m, ft, us-ft or cm");
}

RawGrid open_raw(const std::string& path, const RasterOptions& options) {
  const GdalMessages messages;
  RawGrid grid;
  grid.path = path;
  auto dataset = open_dataset(path);
  const int number = choose_band(path, *dataset, options);
  GDALRasterBand& band = *dataset->GetRasterBand(number);
  grid.width = band.GetXSize();
  grid.height = band.GetYSize();
  grid.type = band.GetRasterDataType();
  if (grid.type == GDT_Unknown || GDALDataTypeIsComplex(grid.type))
    throw Error(path, std::string("holds samples of type ") + GDALGetDataTypeName(grid.type),
                "heights are real or integer numbers");
  read_geotransform(*dataset, grid);
  const char* const registration = dataset->GetMetadataItem("AREA_OR_POINT");
  grid.pixel_is_area = !(registration && EQUAL(registration, "Point"));
  read_crs(*dataset, options, grid);
  read_heights(*dataset, band, options, grid);
  grid.nodata = nodata_of(band, options);
  refuse_missing_blocks(band, grid);
  refuse_short_raw_file(*dataset, grid);
  grid.rows = make_file_rows(path, std::move(dataset), number, grid.nodata);
  return grid;
}

}  // namespace patchwork::raster_impl
