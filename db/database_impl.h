// What Database hides: the store, the state read from it and the caches.
#pragma once

#include <atomic>
#include <mutex>
#include <set>
#include <shared_mutex>

#include "db/database.h"
#include "db/error.h"
#include "db/lru_cache.h"
#include "db/payload.h"
#include "db/store.h"

namespace patchwork {

struct Database::Impl {
  Impl(std::unique_ptr<Store> opened, std::size_t memory);

  /// Takes grids and tree as the store's current transaction has them; records and pages are read when asked
  /// for. Cached heights stay where their grids do. Where it throws Error there is no grid, until it is
  /// called again.
  void load();
  void read_state();  ///< of load()
  void forget_heights(const std::set<GridId>& gone);
  /// Runs `work` in a write transaction that it ends with commit(), true, or rollback(), false; afterwards,
  /// whatever happens, this is a state of the store.
  void change(const std::function<bool()>& work);
  /// Lets go of records and pages if they take more than their share of memory and nobody reads.
  void trim();

  std::optional<Bytes> blob(Store::Kind kind, std::uint64_t key);
  PatchRecords stored_records(const GridInfo& grid);
  std::shared_ptr<const Chunk> chunk(const GridInfo& grid, int level, int cx, int cy);
  std::size_t place(GridId id) const;
  std::size_t place(const std::string& name) const;  ///< throws Error: there is none

  std::unique_ptr<Store> store;
  std::unique_ptr<Store> watch;  // another connection, that sees what comes; made when first asked for
  std::mutex store_mutex;        // the store is one connection; blobs are read from many threads
  std::shared_mutex structure;   // shared by those who hold references into records or pages
  std::size_t structure_share;   // bytes
  std::atomic<std::size_t> runs_read{0};
  std::string crs;
  std::uint64_t version = 0;
  std::vector<Grid> grids;  // by id
  LodTree tree;
  std::optional<Error> tree_damage;  // why the tree could not be opened
  CoverageCounts counts;
  LruCache<std::uint64_t, Chunk> chunks;
  LruCache<std::uint64_t, PatchSurface> surfaces;
};

/// The key of page n of the R-tree; key 0 holds the tree's header.
constexpr std::uint64_t tree_page_key(std::uint32_t page) { return std::uint64_t{page} + 1; }

}  // namespace patchwork
