#include "render/tile_cache.h"

#include <algorithm>
#include <cassert>
#include <string>

namespace patchwork {

TileCache::TileCache(std::uint32_t slots, TilePolicy policy) : tiles_(slots), policy_(policy) { clear(); }

void TileCache::clear() {
  nodes_.clear(), free_.clear();
  for (std::uint32_t s = slots(); s-- > 0;) tiles_[s] = {}, free_.push_back(s);
}

const TileCache::Node* TileCache::find(const TileKey& key) const {
  const auto at = nodes_.find(key);
  return at == nodes_.end() ? nullptr : &at->second;
}

void TileCache::use(const TileKey& key, double pixels) {
  Node& n = nodes_.at(key);
  n.used = selection_, n.pixels = pixels;
}

bool TileCache::better_victim(const Node& a, const Node& b) const {
  if (policy_ == TilePolicy::lru) return a.used < b.used;
  return a.pixels != b.pixels ? a.pixels < b.pixels : a.used < b.used;
}

std::size_t TileCache::room() const {
  const auto idle = [&](const Slot& s) { return s.known && !in_use(nodes_.at(s.tile)); };
  return free_.size() + std::size_t(std::count_if(tiles_.begin(), tiles_.end(), idle));
}

std::uint32_t TileCache::take_slot(const TileKey& key) {
  if (const Node* own = find(key); own && own->drawable()) return own->slot;
  if (free_.empty()) {
    std::uint32_t victim = kNoSlot;
    for (std::uint32_t s = 0; s < slots(); ++s) {
      if (!tiles_[s].known) continue;
      const Node& n = nodes_.at(tiles_[s].tile);
      if (in_use(n)) continue;
      if (victim == kNoSlot || better_victim(n, nodes_.at(tiles_[victim].tile))) victim = s;
      if (policy_ == TilePolicy::first) break;
    }
    if (victim == kNoSlot) return kNoSlot;
    nodes_.erase(tiles_[victim].tile);
    give_up(victim), ++evictions_;
  }
  const std::uint32_t slot = free_.back();
  free_.pop_back();
  tiles_[slot].taken = true;
  return slot;
}

void TileCache::give_up(std::uint32_t slot) { tiles_[slot] = {}, free_.push_back(slot); }

void TileCache::put(const TileKey& key, const TileFacts& facts, std::uint32_t slot) {
  Node& n = nodes_[key];
  if (n.slot != kNoSlot && n.slot != slot) give_up(n.slot);
  n.facts = facts, n.slot = slot, n.used = selection_;
  n.empty = slot == kNoSlot, n.stale = false;
  if (slot == kNoSlot) return;
  assert(tiles_[slot].taken && (!tiles_[slot].known || tiles_[slot].tile == key));
  tiles_[slot] = {key, true, true};
}

// A tile's halo reads a little beyond its border.
void TileCache::invalidate(const TileLattice& lattice, const Extent& place) {
  for (auto& [key, node] : nodes_) {
    const double halo = lattice.step(key.level);
    Extent e = lattice.bounds(key);
    e.xmin -= halo, e.ymin -= halo, e.xmax += halo, e.ymax += halo;
    node.stale |= e.meets(place);
  }
}

std::string TileCache::find_violation() const {
  std::size_t with_slot = 0;
  for (const auto& [key, node] : nodes_) {
    if (!node.drawable()) continue;
    ++with_slot;
    const Slot& s = tiles_[node.slot];
    if (!s.known || s.tile != key) return "slot " + std::to_string(node.slot) + " does not know its tile";
  }
  std::size_t known = 0;
  for (const Slot& s : tiles_) known += s.known;
  if (known != with_slot) return "slots know tiles that do not know them";
  return {};
}

}  // namespace patchwork
