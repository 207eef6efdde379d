// The file: transactions, grids, patch records, tree pages and payloads. Nothing above knows how they are
// kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "db/grid.h"

namespace patchwork {

using Bytes = std::vector<std::byte>;

/// One connection to a database file. Not safe for concurrent use. Every call throws Error (path, problem,
/// advice) for what the file system or a damaged file does; blobs carry checksums that are verified when they
/// are read.
class Store {
 public:
  enum class Mode { read, write, create };  ///< create: also makes the file if it is not there
  static Store open(const std::string& path, Mode mode);
  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();
  const std::string& path() const;

  /// A read transaction sees one state until it ends; a write transaction waits a while for another writer,
  /// then throws.
  void begin_read();
  void begin_write();
  void commit();
  void rollback();  ///< also ends a read transaction; never throws

  std::optional<std::string> fact(const std::string& key);
  void set_fact(const std::string& key, const std::string& value);

  std::vector<GridInfo> grids();
  GridId add_grid(const GridInfo& info);  ///< `info.id` is ignored, the new one returned
  void update_grid(const GridInfo& info);

  /// Structure: what a query reads.
  std::vector<PatchRecord> patches(const GridInfo& grid);
  std::vector<Offer> offers(const GridInfo& grid);
  /// Writes records whose index lies in a changed run; `changed` as sorted indices, all if empty.
  void put_patches(const Grid& grid, std::span<const std::size_t> changed);
  void put_offers(const Grid& grid);
  std::vector<std::pair<std::uint32_t, Bytes>> tree_pages();
  void put_tree_page(std::uint32_t page, std::span<const std::byte> bytes);
  void erase_tree_page(std::uint32_t page);
  void erase_tree();

  /// Payload: heights by chunk. `std::nullopt` where there is none (a chunk without data).
  std::optional<Bytes> payload(GridId grid, int level, int cx, int cy);
  void put_payload(GridId grid, int level, int cx, int cy, std::span<const std::byte> bytes);
  std::uint64_t file_bytes() const;

 private:
  struct Impl;
  explicit Store(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace patchwork
