// A cache of shared values, bounded by a cost, that many threads may use at once.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

namespace patchwork {

/// Values stay alive while anyone holds them; the least recently used are let go when the sum of costs
/// exceeds the capacity. Two threads that miss the same key at once may both make the value; the first one
/// made is kept.
template <class Key, class Value>
class LruCache {
 public:
  explicit LruCache(std::size_t capacity) : capacity_(capacity) {}

  /// `make()` returns std::shared_ptr<const Value>; it runs without the cache's lock. `cost` is the value's
  /// share.
  template <class Make>
  std::shared_ptr<const Value> get(const Key& key, std::size_t cost, Make make) {
    if (auto hit = find(key)) return hit;
    std::shared_ptr<const Value> made = make();
    const std::lock_guard lock(mutex_);
    if (const auto it = places_.find(key); it != places_.end()) return it->second->value;
    items_.push_front({key, cost, made});
    places_[key] = items_.begin();
    for (used_ += cost; used_ > capacity_ && items_.size() > 1; items_.pop_back()) {
      used_ -= items_.back().cost;
      places_.erase(items_.back().key);
    }
    return made;
  }

  /// Lets go of the values whose keys are `gone(key)`.
  template <class Gone>
  void erase_if(Gone gone) {
    const std::lock_guard lock(mutex_);
    for (auto it = items_.begin(); it != items_.end();) {
      if (!gone(it->key)) {
        ++it;
        continue;
      }
      used_ -= it->cost, places_.erase(it->key);
      it = items_.erase(it);
    }
  }

 private:
  struct Item {
    Key key;
    std::size_t cost;
    std::shared_ptr<const Value> value;
  };
  std::shared_ptr<const Value> find(const Key& key) {
    const std::lock_guard lock(mutex_);
    const auto it = places_.find(key);
    if (it == places_.end()) return nullptr;
    items_.splice(items_.begin(), items_, it->second);
    return it->second->value;
  }
  std::mutex mutex_;
  std::list<Item> items_;
  std::unordered_map<Key, typename std::list<Item>::iterator> places_;
  std::size_t capacity_, used_ = 0;
};

}  // namespace patchwork
