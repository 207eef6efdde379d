// A terrain made from a height file: its bicubic surface with invented fine detail, known everywhere.
#pragma once

#include <memory>
#include <string>

#include "db/frame.h"
#include "tools/terrain_function.h"

namespace patchwork {

struct RasterFieldOptions {
  std::string crs{};       ///< of the points that are asked for; empty: the file's own
  double detail = 2;       ///< metres, bound of the invented detail (waves of 60 m and 25 m)
  std::uint32_t seed = 1;  ///< of the detail
};

/// Bicubic Hermite with central differences through the file's pixel centres, plus the detail. Beyond the
/// file the outermost heights go on.
class RasterField : public HeightField {
 public:
  /// Reads the first band whole. Throws Error: unreadable, smaller than 2 x 2, voids in it, no way between
  /// the CRSs.
  RasterField(const std::string& path, const RasterFieldOptions& options);
  ~RasterField() override;

  void heights(std::span<const double> x, std::span<const double> y, std::span<double> out) const override;

  /// The file's footprint (pixel centres) in the CRS of the points, from points along its outline.
  Extent extent() const;
  /// How far the file's own bilinear surface departs from this terrain, metres: its honest accuracy.
  double source_accuracy() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
