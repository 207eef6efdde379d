// Reads ahead what tiles are made from, on threads of its own.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <unordered_set>
#include <vector>

#include "render/tile_lattice.h"

namespace patchwork {

/// Nothing on the way of a frame waits for a disk: what is wanted is fetched here, and made when it is ready.
class TileFetcher {
 public:
  /// `fetch` is called on the workers, one tile at a time each; what it throws, take() throws.
  TileFetcher(int workers, std::function<void(const TileKey&)> fetch);
  ~TileFetcher();
  TileFetcher(const TileFetcher&) = delete;
  TileFetcher& operator=(const TileFetcher&) = delete;

  /// What is fetched from now on, the most wanted first; what is not named any more is forgotten.
  void want(std::span<const TileKey> tiles);
  /// The first `most` of `tiles` that were fetched; they are forgotten here.
  std::vector<TileKey> take(std::span<const TileKey> tiles, std::size_t most);
  /// No worker begins anything until release(). True if none reads any more: the database may move on; else
  /// ask again a frame later.
  bool hold();
  /// `moved`: it did, and what was fetched is fetched again.
  void release(bool moved);

 private:
  void work();
  std::mutex mutex_;
  std::condition_variable more_;
  std::vector<TileKey> queue_;  // the most wanted last
  std::unordered_set<TileKey> running_, ready_;
  std::exception_ptr failure_;
  bool ends_ = false, held_ = false;
  std::function<void(const TileKey&)> fetch_;
  std::vector<std::thread> workers_;  // last: they use the rest
};

}  // namespace patchwork
