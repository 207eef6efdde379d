// Where a database is kept, behind one narrow interface: transactions, facts, grids, blobs and a log of
// changes. Nothing above it knows how; SQLite is the embedded default (sqlite_store.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "db/grid.h"

namespace patchwork {

using Bytes = std::vector<std::byte>;

/// One committed change: which grid came or went, and where answers changed.
struct Change {
  std::uint64_t version = 0;  ///< of the database after it
  std::string what;           ///< "import NAME", "remove NAME", "repair"
  Extent extent;
};

/// One connection to a database. Not safe for concurrent use. Every call throws Error (path, problem, advice)
/// for what the file system or a damaged file does; blobs carry checksums that are verified when they are
/// read.
class Store {
 public:
  /// Kinds of blobs, and what their 64-bit keys mean. Ranges of keys are closed below, open above.
  enum class Kind {
    records,    ///< a RecordRun: grid << 48 | run
    tree_page,  ///< 0: the R-tree's header; n + 1: its page n
    payload     ///< a chunk of heights: PatchId of grid, level, chunk column and row
  };

  virtual ~Store() = default;
  virtual const std::string& path() const = 0;

  /// A read transaction sees one state until it ends; a write transaction waits a while for another writer,
  /// then throws.
  virtual void begin_read() = 0;
  virtual void begin_write() = 0;
  virtual void commit() = 0;
  virtual void rollback() noexcept = 0;  ///< also ends a read transaction

  virtual std::optional<std::string> fact(const std::string& key) = 0;
  virtual void set_fact(const std::string& key, const std::string& value) = 0;

  virtual std::vector<GridInfo> grids() = 0;           ///< by id
  virtual GridId add_grid(const GridInfo& info) = 0;   ///< `info.id` is ignored, the new one returned
  virtual void update_grid(const GridInfo& info) = 0;  ///< of the same id
  virtual void remove_grid(GridId id) = 0;             ///< its row; its blobs are the caller's

  virtual std::optional<Bytes> blob(Kind kind, std::uint64_t key) = 0;
  virtual void put_blob(Kind kind, std::uint64_t key, std::span<const std::byte> bytes) = 0;
  virtual void erase_blobs(Kind kind, std::uint64_t first, std::uint64_t end) = 0;
  /// Keys of a range in order; the blobs' bytes are not read.
  virtual std::vector<std::uint64_t> keys(Kind kind, std::uint64_t first, std::uint64_t end) = 0;

  virtual void note_change(const Change& change) = 0;
  virtual std::vector<Change> changes_after(std::uint64_t version) = 0;  ///< by version

  /// What is wrong with the file below the level of blobs; empty where nothing is.
  virtual std::vector<std::string> find_damage() = 0;
  virtual std::uint64_t file_bytes() const = 0;

  virtual bool made_file() const = 0;  ///< there was none when it was opened
  virtual void remove_file() = 0;      ///< REQUIRES: in a write transaction
};

enum class StoreMode { read, write, create };  ///< create: also makes the file if it is not there

/// Opens the file `path`. Throws Error: no such file, another program's database, a newer schema, damage.
std::unique_ptr<Store> open_store(const std::string& path, StoreMode mode);

/// The keys [first, end) of a grid's blobs.
inline std::uint64_t first_key(GridId grid) { return std::uint64_t{grid.value} << 48; }
inline std::uint64_t end_key(GridId grid) { return std::uint64_t{grid.value + 1} << 48; }

}  // namespace patchwork
