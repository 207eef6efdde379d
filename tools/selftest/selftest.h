// Hard cases on a database of one's own: those of the design whose law can be asked of any data.
#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "blend/blend.h"
#include "query/extract.h"

namespace patchwork::cli {

struct SelfTestOptions {
  int tries = 20000;  ///< points or places of each case
  std::uint64_t seed = 1;
  std::uint64_t memory = kDefaultMemory;
};

/// What a case found. It holds where something was tried, and the worst is at most the limit.
struct Verdict {
  std::string name, law;  ///< the law in a few words
  std::uint64_t tries = 0;
  double worst = 0, limit = 0;
  std::string unit;      ///< of worst and limit
  std::string left_out;  ///< why the case was not tried; empty where it was
  bool holds() const { return !left_out.empty() || (tries > 0 && worst <= limit); }
};

/// What the cases share.
struct Trial {
  const Database& db;
  SelfTestOptions options;
  std::mt19937_64 random;
  std::vector<double> errors;  ///< 0 and a ladder up to the coarsest patch, metres
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); }
  const Grid& any_grid() { return db.grids()[std::size_t(integer(0, int(db.grids().size()) - 1))]; }
};

struct Points {
  std::vector<double> x, y;
  std::size_t size() const { return x.size(); }
  void add(Point p) { x.push_back(p.x), y.push_back(p.y); }
};
Points points_in(Trial& trial, const Extent& extent, int count);

struct Heights {
  std::vector<double> height, bound;
  std::vector<std::int32_t> source;
};
Heights heights_of(const Evaluator& surface, const Points& points);
Heights heights_of(const Database& db, std::span<const PatchId> patches, const Points& points,
                   const BlendOptions& options = {});
/// The patches whose domains hold a point, at an error.
std::vector<PatchId> patches_at(const Database& db, Point p, double error);

/// Every smoothness with both compositions.
std::vector<BlendOptions> all_blends();

// Of the surface (surface_cases.cpp, place_cases.cpp).
Verdict bound_holds(Trial& trial);
Verdict bound_is_what_was_asked(Trial& trial);
Verdict summation_order(Trial& trial);
Verdict cpu_gpu_parity(Trial& trial);
Verdict continuity(Trial& trial);
Verdict source_exact(Trial& trial);
Verdict rim_weights(Trial& trial);
Verdict spline_stencil(Trial& trial);
Verdict nodata_edges(Trial& trial);
// Of the database (database_cases.cpp).
Verdict rotated_nesting(Trial& trial);
Verdict invariant(Trial& trial);
/// OrderPermutations, InsertRemove and EqualGrids, on a copy with small grids that come and go.
std::vector<Verdict> changes(Trial& trial);

/// All of them; `progress` is told the share done.
std::vector<Verdict> run_selftest(const Database& db, const SelfTestOptions& options,
                                  const std::function<void(double)>& progress);

}  // namespace patchwork::cli
