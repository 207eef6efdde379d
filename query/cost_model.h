// What an answer will cost, before it is asked for; and the answer that fits into a time.
#pragma once

#include <functional>
#include <memory>

#include "query/extract.h"

namespace patchwork {

/// Seconds that an extraction takes once the pages and records that it reads are in memory.
struct CostModel {
  double fixed = 0;  ///< seconds
  double page = 0;   ///< seconds a page of the R-tree
  double patch = 0;  ///< seconds a patch of the answer
  double seconds(double pages, double patches) const { return fixed + page * pages + patch * patches; }
};

/// Measures this database on this machine: answers to uniform cuts, coarse ones first, for a tenth of a
/// second.
CostModel calibrate(const Database& db);

/// Reads the inner pages that the cut meets and at most kSampledLeaves of the pages below them, evenly
/// chosen, so `patches` and `bytes` are an estimate and exact where there are no more; `boxes` counts what
/// would be compared.
inline constexpr std::size_t kSampledLeaves = 64;
Cost expect(const Database& db, const CutSurface& cut, const CostModel& model);

/// The smallest error on a ladder of quarter octaves below `most` (and 0) whose expected time is at most nine
/// tenths of `seconds`, and none coarser is beyond it: so a larger budget never gives a larger error. What is
/// read for the first time takes longer: where it did, the answer is taken once more.
Budgeted extract_in_time(const Database& db, const CostModel& model, double seconds, double most,
                         const std::function<std::unique_ptr<CutSurface>(double error)>& cut_at);

}  // namespace patchwork
