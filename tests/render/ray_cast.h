// The reference picture: what each pixel's ray meets first, in double precision. Slow and plain on purpose.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "blend/blend.h"
#include "render/camera.h"
#include "render/effects/curvature.h"

namespace patchwork {

/// A surface z(x, y), and what marching needs to know of it.
struct CastSurface {
  /// Heights at points; NaN where there is none. Called with many points at once.
  std::function<void(std::span<const double> x, std::span<const double> y, std::span<double> z)> heights;
  Extent extent{-INFINITY, -INFINITY, INFINITY, INFINITY};  ///< no heights beyond it
  double lowest = 0, highest = 0;                           ///< no height is beyond these, metres
  double step = 1;  ///< metres along a ray from sample to sample: less than its finest feature
};

CastSurface surface_of(std::function<double(double, double)> z, double lowest, double highest, double step);
/// All that `blend` gives for `patches` of `db`; samples a quarter of the finest cell apart. REQUIRES: both
/// outlive the result.
CastSurface surface_of(const Database& db, std::span<const PatchId> patches, const Evaluator& blend);

struct CastOptions {
  std::optional<effects::Curvature> curvature = {};  ///< the ground sinks with its distance in the plane
  double near = 0, far = INFINITY;                   ///< metres along the ray
};

/// What a ray meets first. Surfaces are met from above and, where they are seen at their rim, from below.
struct Hit {
  bool covered = false;
  bool from_below = false;
  double distance = 0;   ///< metres along the ray
  glm::dvec3 at{0};      ///< the point of the ray, metres (its z is the height less what curvature takes)
  glm::dvec3 normal{0};  ///< of the surface there, upward, without curvature; CAVEAT: k = 0 has none on edges
};

std::vector<Hit> cast(const CastSurface& surface, std::span<const Ray> rays, const CastOptions& options = {});
/// A hit a pixel, row-major from the top left.
std::vector<Hit> cast(const CastSurface& surface, const Camera& camera, const CastOptions& options = {});

}  // namespace patchwork
