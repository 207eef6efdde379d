// A terrain database: its grids, patches and LOD-space tree as one consistent state, and the heights behind
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "db/coverage.h"
#include "db/grid.h"
#include "db/ingest.h"
#include "db/lod_tree.h"
#include "db/patch_surface.h"
#include "db/raster.h"

namespace patchwork {

inline constexpr std::size_t kDefaultMemory = std::size_t{1} << 30;

struct ImportOptions {
  std::string name = {};                ///< of the grid; unique in the database
  std::size_t memory = kDefaultMemory;  ///< bytes
  bool dry_run = false;                 ///< all of it, then nothing is kept
  Progress progress = {};               ///< share done; may be empty
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
  Extent extent;
  struct Seconds {
    double scan = 0, errors = 0, encode = 0, invariant = 0, store = 0, total = 0;
  } seconds;
};

/// One state of a database file. Reading is safe from many threads; importing is not, and moves this object
/// to the new state.
class Database {
 public:
  /// Throws Error: no such file, another program's database, a newer schema, damage.
  static Database open(const std::string& path, std::size_t memory = kDefaultMemory);
  /// Opens for writing, making the file (with this CRS, WKT2 or empty) where there is none.
  static Database open_or_create(const std::string& path, const std::string& crs,
                                 std::size_t memory = kDefaultMemory);
  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  const std::string& path() const;
  const std::string& crs() const;  ///< WKT2, empty where no grid named one
  std::span<const Grid> grids() const;
  const Grid& grid(GridId id) const;
  const PatchRecord& patch(PatchId id) const;
  const LodTree& tree() const;
  Extent extent() const;  ///< of all footprints
  CoverageCounts coverage_counts() const;
  std::uint64_t file_bytes() const;
  std::uint64_t sample_bytes() const;  ///< of the raw samples of all grids

  /// Hex of a hash over grids, samples, bottoms and tops in canonical order (by digest), and nothing else.
  std::string content_hash() const;

  /// The patch's heights, from a cache bounded by the database's memory. Throws Error for damaged payloads.
  std::shared_ptr<const PatchSurface> surface(PatchId id) const;

  /// Adds a grid in one transaction: either all of it is there afterwards or nothing of it. Throws Error.
  ImportReport import(const RasterSource& source, const ImportOptions& options);

  struct Impl;

 private:
  explicit Database(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The box of a patch in LOD space, rounded outward; bottom 0 where it is best available somewhere.
LodBox lod_box(const Grid& grid, std::size_t index);

}  // namespace patchwork
