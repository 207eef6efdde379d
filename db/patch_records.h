// The records of one grid's patches, in runs of 256 that are read from the store when first asked for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "db/lazy_table.h"

namespace patchwork {

/// A patch without its heights. Errors in metres, eps and q included.
struct PatchRecord {
  enum Flag : std::uint64_t { kExists = 1, kBest = 2, kRagged = 4 };
  std::array<double, 3> error{};  ///< of smoothness k = 0, 1, 2: the bound where this patch speaks
  /// The largest of `error`, one index for every k; at level 0 that of k = 0. A smooth surface through the
  /// samples departs from the bilinear one by as much as the data are rough, and if that counted a rough
  /// survey would rank behind the blurred one that it is meant to replace.
  double bottom = 0;
  double top = std::numeric_limits<double>::infinity();
  std::uint64_t flags = 0;

  bool exists() const { return flags & kExists; }
  /// Best available somewhere: its box reaches down to error 0.
  bool best() const { return flags & kBest; }
  /// Some cell of its domain holds no data.
  bool ragged() const { return flags & kRagged; }
  /// Redundant: kept, but in no cut.
  bool dormant() const { return top <= bottom; }
  bool operator==(const PatchRecord&) const = default;
};
static_assert(sizeof(PatchRecord) == 48);

/// What a ragged patch offers other grids as cover: at most eight disjoint rectangles of its block's cells.
struct Offer {
  std::uint32_t index = 0;  ///< GridShape::index of the patch
  std::uint32_t count = 0;
  std::array<std::array<std::uint8_t, 4>, 8>
      cells{};  ///< i0, j0, i1, j1 in level cells from the block's corner
  bool operator==(const Offer&) const = default;
};
static_assert(sizeof(Offer) == 40);

/// Records [256 n, 256 n + 256) of a grid (fewer in the last run), and the offers of the ragged ones among
/// them, sorted by index.
struct RecordRun {
  static constexpr std::size_t kRecords = 256;
  std::vector<PatchRecord> records;
  std::vector<Offer> offers;
  bool operator==(const RecordRun&) const = default;

  /// Little-endian as in memory: the records, then the offers.
  std::vector<std::byte> bytes() const;
  /// Run `run` of a grid of `patches`; `problem` says what is wrong with hostile bytes.
  static RecordRun from_bytes(std::span<const std::byte> bytes, std::size_t run, std::size_t patches,
                              std::string& problem);
};

/// By GridShape::index; blocks without data do not exist(). Many threads may read; who changes must be alone.
class PatchRecords {
 public:
  using Load = LazyTable<RecordRun>::Load;

  PatchRecords() = default;
  /// `size` records that do not exist, in memory.
  explicit PatchRecords(std::size_t size);
  PatchRecords(std::size_t size, Load load);

  std::size_t size() const { return size_; }
  const PatchRecord& operator[](std::size_t k) const {
    return runs_[k / RecordRun::kRecords].records[k % RecordRun::kRecords];
  }
  PatchRecord& change(std::size_t k) {
    return runs_.change(k / RecordRun::kRecords).records[k % RecordRun::kRecords];
  }
  /// What patch k offers; null where it offers nothing, or is not ragged and offers its kernel.
  const Offer* offer(std::size_t k) const;
  /// Calls visit(k, record) for all, in order, without keeping what is not in memory.
  template <class Visit>
  void each(Visit visit) const {
    std::size_t k = 0;
    runs_.each([&](const RecordRun& run) {
      for (const PatchRecord& p : run.records) visit(k++, p);
    });
  }
  LazyTable<RecordRun>& runs() { return runs_; }
  const LazyTable<RecordRun>& runs() const { return runs_; }
  bool operator==(const PatchRecords& o) const;

 private:
  std::size_t size_ = 0;
  LazyTable<RecordRun> runs_;
};

}  // namespace patchwork
