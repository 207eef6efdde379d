// A terrain database: its grids, patches and LOD-space tree as one consistent state, and the heights behind
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <vector>

#include "db/check.h"
#include "db/coverage.h"
#include "db/grid.h"
#include "db/ingest.h"
#include "db/lod_tree.h"
#include "db/patch_surface.h"
#include "db/raster.h"
#include "db/store.h"

namespace patchwork {

inline constexpr std::size_t kDefaultMemory = std::size_t{1} << 30;

struct ImportOptions {
  std::string name = {};                ///< of the grid; unique in the database
  std::size_t memory = kDefaultMemory;  ///< bytes
  bool dry_run = false;                 ///< all of it, then nothing is kept
  double tolerance = 0;      ///< metres by which a stored sample may differ from the file's; enters the bound
  std::string replace = {};  ///< a grid that goes out in the same transaction; may have the new one's name
  Progress progress = {};    ///< share done, 0 once nobody else can write, 1 when all but the commit is done
};

struct ImportReport {
  std::string name;
  std::string duplicate_of;  ///< not empty: the same grid is there under this name, nothing was added
  double accuracy = 0;       ///< metres
  double quantisation = 0;   ///< metres
  std::size_t patches = 0;   ///< added
  std::size_t dormant = 0;   ///< of the added, redundant from the start
  std::size_t hidden = 0;    ///< patches of other grids that became redundant
  std::size_t lowered = 0;   ///< patches of other grids whose top came down, the hidden among them
  std::size_t removed = 0;   ///< patches of the grid that was replaced
  std::size_t woken = 0;     ///< patches of other grids that this one had hidden
  Extent extent;
  struct Seconds {
    double scan = 0, errors = 0, encode = 0, invariant = 0, store = 0, total = 0;
  } seconds;
};

struct RemoveReport {
  std::string name;
  std::size_t patches = 0;  ///< gone
  std::size_t woken = 0;    ///< patches of other grids that are no longer redundant
  std::size_t raised = 0;   ///< patches of other grids whose top went up, the woken among them
  Extent extent;
  double seconds = 0;
};

/// One state of a database file. Reading is safe from many threads, beside a writer in this or another
/// process; refreshing, importing and removing are not, and move this object to a new state.
class Database {
 public:
  /// Throws Error: no such file, another program's database, a newer schema, damage.
  static Database open(const std::string& path, std::size_t memory = kDefaultMemory);
  /// Opens for writing.
  static Database open_existing(const std::string& path, std::size_t memory = kDefaultMemory);
  /// Opens for writing, making the file (with this CRS, WKT2 or empty) where there is none.
  static Database open_or_create(const std::string& path, const std::string& crs,
                                 std::size_t memory = kDefaultMemory);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  bool made_file() const;  ///< open_or_create() did
  /// Takes the file away if it holds no grid and nobody is writing to it: who has it open hears of it at the
  /// next change. After that this object can only be destroyed.
  void remove_if_empty();

  /// Moves to the newest state; false if this is it. Cached heights stay where their grids do.
  bool refresh();
  /// False if refresh() would move it. Safe beside threads that read; one thread at a time may ask.
  bool is_newest() const;
  /// Counts committed changes; the same for every reader of the same state.
  std::uint64_t version() const;
  /// What came and went after `version`, up to this state, oldest first: where a client must look again.
  std::vector<Change> changed_since(std::uint64_t version) const;

  const std::string& path() const;
  const std::string& crs() const;  ///< WKT2, empty where no grid named one
  std::span<const Grid> grids() const;
  const Grid& grid(GridId id) const;
  const Grid& grid(const std::string& name) const;  ///< throws Error: there is none
  PatchRecord patch(PatchId id) const;
  const LodTree& tree() const;
  /// Held while references into a grid's records, or the tree's pages, are used: what is read stays in memory
  /// until then, and is let go of later when it takes more than a quarter of the memory setting.
  using Reading = std::shared_lock<std::shared_mutex>;
  Reading reading() const;
  Extent extent() const;        ///< of all footprints
  HeightRange heights() const;  ///< of all samples; none without grids
  /// Metres: the largest bottom of the grids' coarsest patches; 0 without grids.
  double coarsest_bottom() const;
  CoverageCounts coverage_counts() const;
  std::uint64_t file_bytes() const;
  std::uint64_t sample_bytes() const;  ///< of the raw samples of all grids

  /// Hex of a hash over grids, samples, bottoms and tops in canonical order (by digest), and nothing else.
  std::string content_hash() const;

  /// The patch's heights, from a cache bounded by the database's memory. Throws Error for damaged payloads.
  std::shared_ptr<const PatchSurface> surface(PatchId id) const;

  /// Adds a grid in one transaction: either all of it is there afterwards or nothing of it. Throws Error.
  ImportReport import(const RasterSource& source, const ImportOptions& options);
  /// Takes a grid out in one transaction; whatever it had hidden comes back. Throws Error: no such grid.
  RemoveReport remove(const std::string& name);

  /// What does not hold: file, records, heights' checksums, tops and flags (evaluated from scratch), R-tree.
  std::vector<Problem> check(const Progress& progress = {}) const;
  /// Makes anew what can be derived: tops, flags and R-tree; drops what belongs to no grid.
  RepairReport repair(const Progress& progress = {});

  /// Raw samples of a grid as its file had them (see GridInfo::raw_scale), rows [row, row + rows), row-major;
  /// NaN where there is no data. REQUIRES: the rows are inside the grid, and `out` holds them.
  void read_samples(GridId grid, int row, int rows, std::span<double> out) const;

  /// What was found out about the database and is kept in its file, by name: no part of its content, hash or
  /// version. Keeping takes one transaction, and throws Error where the file is not open for writing.
  std::optional<std::string> remark(const std::string& name) const;
  void keep_remark(const std::string& name, const std::string& text);

  struct Impl;

 private:
  explicit Database(std::unique_ptr<Impl> impl);
  static Database in_mode(StoreMode mode, const std::string& path, std::size_t memory);
  std::unique_ptr<Impl> impl_;
};

/// The box of a patch in LOD space, rounded outward; bottom 0 where it is best available somewhere.
LodBox lod_box(const GridInfo& grid, std::size_t index, const PatchRecord& patch);
inline LodBox lod_box(const Grid& grid, std::size_t index) {
  return lod_box(grid.info, index, grid.patches[index]);
}

}  // namespace patchwork
