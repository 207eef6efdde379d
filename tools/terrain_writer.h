// Surveys of a known terrain as GeoTIFF files, each with the accuracy that it truly has.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "db/frame.h"
#include "tools/terrain_function.h"

namespace patchwork {

/// How samples are stored.
struct SampleFormat {
  std::string type = "Float32";  ///< Int16, UInt16, Int32 or Float32
  double quantum = 0.1;          ///< metres per unit of the integer types; Float32 has none
  std::string crs{};             ///< of every file, any form that GDAL understands; empty: none
};

/// One grid to be surveyed.
struct SurveyPlan {
  std::array<double, 6> geotransform{0, 1, 0,
                                     0, 0, -1};  ///< of the vertices: sample (i, j) lies at its (i, j)
  int width = 0, height = 0;                     ///< samples, at least 2
  double noise = 0;                              ///< metres: every sample is off by less, bell-shaped
  double holes = 0;        ///< share of samples without data, 0 to 0.3; a tenth of them single samples
  std::uint32_t seed = 1;  ///< of noise and holes
};

/// What came of it. All lengths in metres.
struct SurveyFacts {
  double interpolation_error = 0;  ///< measured (see `interpolation_error`)
  double rounding = 0;             ///< largest rounding of a stored sample
  double accuracy = 0;             ///< interpolation error + rounding + noise
  double lowest = 0, highest = 0;  ///< of the samples
  long long voids = 0;             ///< samples without data
};

/// The geotransform of a survey of width x height samples about `centre`; the i axis points `angle` degrees
/// to the right of east, the j axis a right angle further (south at angle 0).
std::array<double, 6> survey_geotransform(Point centre, int width, int height, double step, double angle);

/// Samples `field` into a GeoTIFF (strips, uncompressed, AREA_OR_POINT=Point: the footprint ends at the outer
/// samples) in bands of rows, on all TBB threads. The bytes do not depend on the number of threads.
/// Throws Error(path, ...): a height does not fit the type, the disk does not take it, unknown type or CRS.
SurveyFacts write_survey(const HeightField& field, const SurveyPlan& plan, const SampleFormat& format,
                         const std::string& path);

}  // namespace patchwork
