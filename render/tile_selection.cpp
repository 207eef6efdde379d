#include "render/tile_selection.h"

#include <algorithm>
#include <unordered_set>

namespace patchwork {

namespace {

// Splits the worst leaf until all keep to the pixel error; a leaf is only split if all of its children are
// there, and after its neighbours that are larger than it.
class Selector {
 public:
  Selector(const TileLattice& lattice, const Frustum& frustum, const SelectionOptions& options,
           TileCache& cache, Selection& out)
      : lattice_(lattice), frustum_(frustum), options_(options), cache_(cache), out_(out) {
    out_.clear();
    cache_.begin_selection();
  }

  void run() {
    const TileCache::Node* root = cache_.find(lattice_.root());
    if (!root || (!root->drawable() && !root->empty)) {
      want(lattice_.root(), 1e9);
      return;
    }
    add(lattice_.root(), *root);
    while (!queue_.empty()) {
      std::pop_heap(queue_.begin(), queue_.end(), worse());
      const std::uint32_t worst = queue_.back();
      queue_.pop_back();
      const TileKey key = out_.leaves[worst].key;
      if (out_.tiles.at(key) == worst) try_split(worst, out_.leaves[worst].pixels);
    }
    finish();
  }

 private:
  struct Less {
    const std::vector<Selection::Leaf>& leaves;
    bool operator()(std::uint32_t a, std::uint32_t b) const { return leaves[a].pixels < leaves[b].pixels; }
  };
  Less worse() const { return {out_.leaves}; }

  void want(const TileKey& key, double pixels) { out_.wanted.push_back({key, pixels}); }

  void add(const TileKey& key, const TileCache::Node& node) {
    const Box3 box{lattice_.bounds(key), node.facts.lowest, node.facts.highest};
    Selection::Leaf leaf{key};
    // What finer tiles show may stick out of what this one knows by its error.
    const Box3 around{box.place, box.lowest - node.facts.error, box.highest + node.facts.error};
    leaf.drawn = !node.empty && frustum_.sees(around);
    if (leaf.drawn) leaf.pixels = pixels_of(key, node.facts, box);
    const auto place = std::uint32_t(out_.leaves.size());
    out_.leaves.push_back(leaf);
    out_.tiles[key] = place;
    if (!node.empty) use(key, leaf.pixels);
    if (node.stale && (leaf.drawn || may_be_seen(box.place))) {
      stale_.push_back(place);
      held_ += node.empty;  // it may need a slot now
    }
    if (!leaf.drawn) return;
    ++drawn_;
    if (leaf.pixels <= options_.pixel_error || key.level == 0) return;
    queue_.push_back(place);
    std::push_heap(queue_.begin(), queue_.end(), worse());
  }

  // Of its parts in sight only where it would be too coarse as a whole.
  double pixels_of(const TileKey& key, const TileFacts& facts, const Box3& box) const {
    const double whole = facts.error > 0 ? facts.error * frustum_.pixels_per_metre(box) : 0;
    if (whole <= options_.pixel_error) return whole;
    const double side = lattice_.step(key.level) * TileLattice::kCells / TileFacts::kParts;
    double most = 0;
    for (int y = 0; y < TileFacts::kParts; ++y)
      for (int x = 0; x < TileFacts::kParts; ++x) {
        const auto& [error, heights] = facts.part(x, y);
        if (error <= 0) continue;
        const double west = box.place.xmin + x * side, south = box.place.ymin + y * side;
        const Box3 part{{west, south, west + side, south + side}, heights.lowest, heights.highest};
        const Box3 around{part.place, heights.lowest - error, heights.highest + error};
        if (frustum_.sees(around)) most = std::max(most, error * frustum_.pixels_per_metre(part));
      }
    return most;
  }

  // Whatever the terrain there is now.
  bool may_be_seen(const Extent& place) const {
    const HeightRange& h = options_.heights;
    return h.lowest <= h.highest && frustum_.sees({place, h.lowest, h.highest});
  }

  // Is `key` a leaf, or split? If a larger leaf stands there instead, it is split first, as urgently as what
  // asks for it.
  bool make_room(const TileKey& key, double pixels) {
    if (!lattice_.contains(key) || out_.tiles.contains(key)) return true;
    const auto above = out_.tiles.find(key.parent());
    if (above == out_.tiles.end() || above->second == Selection::kSplit) return true;  // in what is not drawn
    return !out_.leaves[above->second].drawn || try_split(above->second, pixels);
  }

  void use(const TileKey& key, double pixels) {
    held_ += !cache_.in_use(*cache_.find(key));
    cache_.use(key, pixels);
  }

  // Are there slots for the children that are not counted yet?
  bool children_fit(const TileKey& key) const {
    std::size_t more = 0;
    for (int c = 0; c < 4; ++c) {
      const TileCache::Node* n = cache_.find(key.child(c));
      if (n && n->empty) continue;
      more += n ? !cache_.in_use(*n) : !missing_.contains(key.child(c));
    }
    return held_ + more <= options_.slots;
  }

  bool children_are_there(const TileKey& key, double pixels) {
    bool all = true;
    for (int c = 0; c < 4; ++c) {
      const TileKey child = key.child(c);
      const TileCache::Node* n = cache_.find(child);
      if (n && (n->empty || n->drawable())) {
        if (!n->empty) use(child, 0);
        continue;
      }
      if (missing_.insert(child).second) ++held_, want(child, pixels);
      all = false;
    }
    return all;
  }

  bool try_split(std::uint32_t place, double pixels) {
    const TileKey key = out_.leaves[place].key;
    if (key.level == 0 || drawn_ + 3 > options_.most_tiles || !children_fit(key)) return false;
    if (!children_are_there(key, pixels)) return false;
    for (int s = 0; s < 4; ++s)
      if (!make_room(key.beside(s), pixels)) return false;
    if (drawn_ + 3 > options_.most_tiles) return false;  // its neighbours may have taken what was left
    out_.leaves[place].drawn = false, --drawn_;
    out_.tiles[key] = Selection::kSplit;
    for (int c = 0; c < 4; ++c) add(key.child(c), *cache_.find(key.child(c)));
    return true;
  }

  // What is missing on the screen comes first, then what shows an old state, at last what is not shown
  // itself.
  void want_stale() {
    for (const std::uint32_t k : stale_) {
      const Selection::Leaf& leaf = out_.leaves[k];
      const bool split = out_.tiles.at(leaf.key) == Selection::kSplit;
      out_.stale |= !split;
      want(leaf.key, leaf.drawn ? std::min(leaf.pixels, options_.pixel_error)
                     : split    ? -1
                                : options_.pixel_error);
    }
  }

  void finish() {
    want_stale();
    for (std::uint32_t k = 0; k < out_.leaves.size(); ++k)
      if (out_.leaves[k].drawn) {
        out_.drawn.push_back(k);
        if (out_.leaves[k].key.level > 0) out_.pixels = std::max(out_.pixels, out_.leaves[k].pixels);
      }
    std::sort(out_.wanted.begin(), out_.wanted.end(), [](const auto& a, const auto& b) {
      return a.pixels != b.pixels ? a.pixels > b.pixels : a.key < b.key;
    });
  }

  const TileLattice& lattice_;
  const Frustum& frustum_;
  const SelectionOptions& options_;
  TileCache& cache_;
  Selection& out_;
  std::vector<std::uint32_t> queue_;  // heap of places
  std::vector<std::uint32_t> stale_;  // places where something else may be in sight
  std::unordered_set<TileKey> missing_;
  std::size_t drawn_ = 0, held_ = 0;  // held: slots, of what is used and for what is wanted
};

}  // namespace

void Selection::clear() {
  tiles.clear(), leaves.clear(), drawn.clear(), wanted.clear();
  stale = false, pixels = 0;
}

// Down to the corner that lies towards (x, y) (0: smaller, 1: larger) where the tile is split, up where a
// larger one holds it.
const Selection::Leaf* Selection::leaf_at(TileKey key, int towards_x, int towards_y) const {
  auto at = tiles.find(key);
  while (at == tiles.end()) {
    if (key.level > TileLattice::kMaxLevels) return nullptr;
    key = key.parent(), at = tiles.find(key);
  }
  while (at->second == kSplit) at = tiles.find(at->first.child(towards_x + 2 * towards_y));
  return &leaves[at->second];
}

void select_tiles(const TileLattice& lattice, const Frustum& frustum, const SelectionOptions& options,
                  TileCache& cache, Selection& selection) {
  Selector(lattice, frustum, options, cache, selection).run();
}

}  // namespace patchwork
