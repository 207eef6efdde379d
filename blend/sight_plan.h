// Where a ray must be looked at: what can come near it, and every place where the surface changes its shape
// (used by sight.cpp).
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "blend/height_tree.h"
#include "blend/placed.h"
#include "blend/sight_path.h"

namespace patchwork {

class SightPlanner {
 public:
  /// Reads all patches. REQUIRES: `db` outlives it.
  SightPlanner(const Database& db, std::span<const PatchId> patches, const BlendOptions& options);

  /// Parameters in ascending order, and what they are.
  struct Plan {
    std::vector<double> t;
    std::vector<SightPlace> place;
    void add(double at, SightPlace what) { t.push_back(at), place.push_back(what); }
  };
  /// Looks wherever the surface can be less than `threshold` (metres) below the ray.
  Plan plan(const SightPath& path, double threshold) const;

  /// Where the ray can be least above the surface.
  double likely(const SightPath& path) const;

  double largest_bound() const { return largest_bound_; }  ///< metres
  double finest_cell() const { return finest_cell_; }      ///< metres along a side of the smallest cells

 private:
  struct Part;
  struct Projected;
  template <class Take>
  void visit_parts(const SightPath& path, const double& threshold, Take take) const;
  std::vector<Part> speakers(const SightPath& path, const std::vector<Part>& parts,
                             std::vector<double>& t) const;
  void add_lines(const Projected& on, const Part& part, std::vector<double>& t) const;
  void add_between(const std::vector<Part>& active, double low, double high, Plan& plan) const;

  BlendOptions options_;
  std::vector<Blend::Placed> placed_;
  HeightTree heights_;
  double largest_bound_ = 0, finest_cell_ = INFINITY;
};

}  // namespace patchwork
