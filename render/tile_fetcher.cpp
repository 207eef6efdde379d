#include "render/tile_fetcher.h"

#include <algorithm>
#include <utility>

namespace patchwork {

TileFetcher::TileFetcher(int workers, std::function<void(const TileKey&)> fetch) : fetch_(std::move(fetch)) {
  for (int k = 0; k < workers; ++k) workers_.emplace_back([this] { work(); });
}

TileFetcher::~TileFetcher() {
  {
    const std::scoped_lock lock(mutex_);
    ends_ = true, queue_.clear();
  }
  more_.notify_all();
  for (std::thread& t : workers_) t.join();
}

void TileFetcher::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    more_.wait(lock, [this] { return ends_ || (!held_ && !queue_.empty()); });
    if (ends_) return;
    const TileKey key = queue_.back();
    queue_.pop_back();
    running_.insert(key);
    lock.unlock();
    std::exception_ptr failure;
    try {
      fetch_(key);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    running_.erase(key);
    if (failure)
      failure_ = failure;
    else
      ready_.insert(key);
  }
}

void TileFetcher::want(std::span<const TileKey> tiles) {
  {
    const std::scoped_lock lock(mutex_);
    queue_.clear();
    for (const TileKey& k : tiles)
      if (!ready_.contains(k) && !running_.contains(k)) queue_.push_back(k);
    std::reverse(queue_.begin(), queue_.end());
    if (ready_.size() > 4 * tiles.size() + 256) {  // what was wanted once, and is not any more
      const std::unordered_set<TileKey> wanted(tiles.begin(), tiles.end());
      std::erase_if(ready_, [&](const TileKey& k) { return !wanted.contains(k); });
    }
  }
  more_.notify_all();
}

std::vector<TileKey> TileFetcher::take(std::span<const TileKey> tiles, std::size_t most) {
  const std::scoped_lock lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  std::vector<TileKey> found;
  for (const TileKey& k : tiles)
    if (found.size() < most && ready_.erase(k) > 0) found.push_back(k);
  return found;
}

bool TileFetcher::hold() {
  const std::scoped_lock lock(mutex_);
  held_ = true;
  return running_.empty();
}

void TileFetcher::release(bool moved) {
  {
    const std::scoped_lock lock(mutex_);
    held_ = false;
    if (moved) ready_.clear(), queue_.clear();  // they may be of another lattice
  }
  more_.notify_all();
}

}  // namespace patchwork
