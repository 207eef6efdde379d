// What an answer will cost, before it is asked for; and the answer that fits into a time.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "query/extract.h"

namespace patchwork {

/// Seconds that the parts of an answer take on one machine: finding patches once the pages and records that
/// are read for it are in memory; reading and decoding patches from the file; evaluating heights on all
/// cores.
struct CostModel {
  /// Of patches beyond this many the records and the answer no longer lie in a processor's cache.
  static constexpr double kCached = 0x1p16;
  double fixed = 0, page = 0, patch = 0;    ///< finding: at all, a page of the R-tree, a patch
  double beyond = 0;                        ///< what a patch beyond kCached takes on top
  double read_fixed = 0, read_patch = 0;    ///< reading: at all, a patch
  double blend_fixed = 0, blend_patch = 0;  ///< evaluating (k = 0): at all, a patch
  double sample = 0, edge = 0;  ///< a height; one along the edges of patches, of which there are about
                                ///< sqrt(patches * heights)
  double seconds(double pages, double patches) const {
    return fixed + page * pages + patch * patches + beyond * std::max(0.0, patches - kCached);
  }
  double read_seconds(double patches) const { return read_fixed + read_patch * patches; }
  double blend_seconds(double patches, double samples) const {
    return blend_fixed + blend_patch * patches + sample * samples + edge * std::sqrt(patches * samples);
  }
  bool knows_heights() const { return read_patch > 0 && sample > 0; }  ///< not only how long finding takes
};

/// One answer and the seconds that its parts took; a part that was not measured has none.
struct Measured {
  double pages = 0, patches = 0, samples = 0;
  double find = 0, read = 0, blend = 0;
};
/// Least squares of relative errors, with no cost below zero. REQUIRES: not empty.
CostModel fit(std::span<const Measured> answers);

/// The model that `patchwork cost` left in the database, if it was measured on this kind of machine.
std::optional<CostModel> saved_model(const Database& db);
/// REQUIRES: `db` is open for writing. Content, hash and version stay.
void save_model(Database& db, const CostModel& model);
/// What this machine is called in a saved model: processor and number of threads.
std::string machine_name();

/// Measures how long finding takes with this database on this machine: answers to uniform cuts, coarse ones
/// first, for three tenths of a second.
CostModel calibrate(const Database& db);
/// The saved model, else a new one of finding alone.
CostModel model_of(const Database& db);

inline constexpr std::size_t kSampledLeaves = 64;
/// Reads the inner pages that the cut meets and at most kSampledLeaves of the pages below them, evenly
/// chosen, so `patches` and `bytes` are an estimate and exact where there are no more; `boxes` counts what
/// would be compared.
Cost expect(const Database& db, const CutSurface& cut, const CostModel& model);

/// The smallest error on a ladder of quarter octaves below `most` (and 0) whose expected time is at most nine
/// tenths of `seconds`, and none coarser is beyond it: so a larger budget never gives a larger error, while
/// the machine is as fast as the model says. An answer that took longer than `seconds` (it was read for the
/// first time, or the machine does something else) is taken once more, then a rung coarser, and so on, six
/// rungs at most.
Budgeted extract_in_time(const Database& db, const CostModel& model, double seconds, double most,
                         const std::function<std::unique_ptr<CutSurface>(double error)>& cut_at);

}  // namespace patchwork
