// What Database hides: the store, the loaded state and the caches (shared by database.cpp and import.cpp).
#pragma once

#include <mutex>

#include "db/database.h"
#include "db/lru_cache.h"
#include "db/payload.h"
#include "db/store.h"

namespace patchwork {

struct Database::Impl {
  Impl(Store opened, std::size_t memory);
  /// Reads structure and tree within the store's current transaction.
  void load();
  std::shared_ptr<const Chunk> chunk(const GridInfo& grid, int level, int cx, int cy);
  std::size_t place(GridId id) const;

  Store store;
  std::mutex store_mutex;  // the store is one connection; payloads are read from many threads
  std::string crs;
  std::vector<Grid> grids;  // by id
  LodTree tree;
  CoverageCounts counts;
  LruCache<std::uint64_t, Chunk> chunks;
  LruCache<std::uint64_t, PatchSurface> surfaces;
};

/// The first page number of the store that holds a tree page; page 0 holds the tree's header.
inline constexpr std::uint32_t kFirstTreePage = 1;

}  // namespace patchwork
