// Lines of sight and rays against the surface, and what its bounds leave undecided.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "blend/blend.h"
#include "db/point3.h"

namespace patchwork {

/// How light travels over the earth.
struct Air {
  bool curved = true;         ///< else the earth is flat, and light straight
  double refraction = 0.13;   ///< light's curvature over the earth's
  double radius = 6'371'000;  ///< of the earth, metres
};

/// Metres by which a level line of sight is above the earth's curve: distance^2 (1 - refraction) / (2
/// radius); 7.85 m at 10 km, 6.83 m with a refraction of 0.13. `distance` in metres along the ground.
double drop(double distance, const Air& air);

/// Light between two points, at heights as the database has them.
struct SightRay {
  Point3 from, to;
};

/// The ray that leaves `from` in a direction and ends after `distance` metres along the ground. Degrees:
/// `azimuth` clockwise from the y axis, `elevation` above the horizontal, below 90 either way.
SightRay directed_ray(const Point3& from, double azimuth, double elevation, double distance, const Air& air);

enum class Verdict {
  visible,  ///< whatever the terrain is within its bounds; places without data hide nothing
  hidden,   ///< the same
  undecided
};

/// Distances along the ground from the ray's beginning, metres; NaN where there is none.
struct Sight {
  bool blocked = false;
  Point3 hit;  ///< where the surface first rises above the ray, to a millimetre along it
  double hit_distance = 0, hit_bound = 0;
  double clearance = 0;  ///< the smallest height of the ray above the surface; negative where blocked
  Point3 nearest;        ///< on the surface, where that is
  double nearest_distance = 0, nearest_bound = 0;
  Verdict verdict = Verdict::undecided;
  std::uint32_t searched = 0;  ///< evaluations that found the hit within its bracket
  std::uint32_t bracket = 0;   ///< its width in millimetres: searched <= 2 log2(bracket) + 3
};

/// REQUIRES: `db` outlives it. Safe for concurrent use; uses all threads. Throws Error: damaged payloads.
class SightLines {
 public:
  /// Terrain that rises above a ray by less than this (metres) need not be seen.
  static constexpr double kClearance = 1e-3;

  /// `patches` in the order of Extraction::patches. Reads all of them.
  SightLines(const Database& db, std::span<const PatchId> patches, const BlendOptions& options);
  ~SightLines();

  /// An answer a ray. The parts of a ray over ground that cannot reach it are skipped by largest heights of
  /// blocks of patches; the others are evaluated at every cell line of every patch there, between them, and
  /// wherever humps between these can matter. A first hit is searched for by interpolation,
  /// guarded: the bracket halves with every other evaluation.
  std::vector<Sight> find(std::span<const SightRay> rays, const Air& air) const;

  const Blend& surface() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
