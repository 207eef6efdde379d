// A terrain that is known everywhere: one analytic function from which test grids of any frame are sampled.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "db/frame.h"
#include "tools/gradient_noise.h"

namespace patchwork {

/// A height, metres, at every point of the plane. Implementations are safe for concurrent use.
class HeightField {
 public:
  virtual ~HeightField() = default;
  /// Heights at the points (x[k], y[k]), metres; the three spans have equal length and x, y are finite. The
  /// value at a point does not depend on the points beside it.
  virtual void heights(std::span<const double> x, std::span<const double> y, std::span<double> out) const = 0;
};

struct TerrainParameters {
  Extent extent{0, 0, 10240, 10240};  ///< metres; sets the largest forms and where the lake lies
  double relief = 1200;               ///< metres between the plains and the highest conceivable summit
  double cliff = 12;                  ///< metres, height of the cliffs; 0 for none
  std::uint32_t seed = 1;
};

/// A round lake: within `radius` / 2 of the centre the terrain lies at `level` exactly.
struct Lake {
  Point centre;
  double radius = 0, level = 0;
};

/// Ridged mountains of up to 14 octaves (down to 12 m), plains between them, two families of cliffs (faces at
/// least about 1 m and 15 m thick), and one lake. Continuous everywhere, creased along ridges and shores.
/// Only IEEE basic operations and sqrt, hence the same bits wherever contraction is off.
class TerrainFunction : public HeightField {
 public:
  /// Throws Error for an empty or non-finite extent, or a negative or non-finite relief or cliff.
  explicit TerrainFunction(const TerrainParameters& parameters);

  double height(double x, double y) const;
  void heights(std::span<const double> x, std::span<const double> y, std::span<double> out) const override;

  const TerrainParameters& parameters() const { return parameters_; }
  const Lake& lake() const { return lake_; }

 private:
  struct Chunk;
  // A step of the terrain where `shape` crosses `level`; it climbs while the shape grows by `width`.
  struct Cliff {
    NoiseOctave shape;
    double level = 0, width = 1, height = 0;
  };

  void add_mountains(Chunk& chunk) const;
  void add_cliffs(Chunk& chunk) const;
  void sink_lake(Chunk& chunk) const;

  TerrainParameters parameters_;
  std::vector<NoiseOctave> ridges_;
  double ridge_scale_ = 0;  // metres per unit of the summed octaves
  NoiseOctave plains_;
  double reach_ = 0;  // metres from the corner; beyond, the terrain is constant along each axis
  std::vector<Cliff> cliffs_;
  Lake lake_;
};

/// What `interpolation_error` multiplies the largest sampled distance by, because samples miss the exact
/// maximum.
inline constexpr double kInterpolationMargin = 1.25;

/// How far the bilinear surface through the field's heights at the vertices of a width x height lattice
/// departs from the field, metres: the largest of one sample in every cell and of 16 x 16 samples in each of
/// the (up to 4096) cells where the first was worst, times the margin. Conservative by sampling, not proven.
/// Runs on all TBB threads; the result does not depend on their number. REQUIRES: width, height >= 2.
double interpolation_error(const HeightField& field, const Frame& frame, int width, int height);

}  // namespace patchwork
