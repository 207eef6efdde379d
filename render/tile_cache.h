// Which tiles are on the card, in which slot, and what is known of each.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "render/frustum.h"
#include "render/tile_lattice.h"

namespace patchwork {

/// What a tile's making told, metres.
struct TileFacts {
  static constexpr int kParts = 4;  ///< along each side
  /// Largest vertical distance of its own mesh from the best surface there is, or from the terrain where that
  /// surface has a better bound: what refining it can take away. Of all of the tile, and of its parts.
  double error = 0;
  double lowest = 0, highest = 0;  ///< of every sample
  struct Part {
    double error = 0;
    HeightRange heights;  ///< none: nothing answers there
  };
  std::array<Part, kParts * kParts> parts;  ///< row-major, from the smallest x and y
  double bound = 0;                         ///< the largest guaranteed error of its heights
  bool holes = false;                       ///< some vertex has no data
  std::size_t patches = 0;                  ///< that it was made of

  Part& part(int x, int y) { return parts[std::size_t(y * kParts + x)]; }
  const Part& part(int x, int y) const { return parts[std::size_t(y * kParts + x)]; }
};

/// How a slot is found for a new tile when none is free.
enum class TilePolicy {
  first,      ///< the first that is not used now
  lru,        ///< the one that was used longest ago
  lru_error,  ///< the same, among those of the smallest error on the screen when last used
};

/// Nodes of the quadtree that have been made, and the fixed pool of slots. A tile knows its slot and a slot
/// its tile. No slot that is used since the last begin_selection() is given away.
class TileCache {
 public:
  static constexpr std::uint32_t kNoSlot = UINT32_MAX;
  struct Node {
    TileFacts facts;
    std::uint32_t slot = kNoSlot;  ///< none: without data
    std::uint64_t used = 0;        ///< the selection that did last
    double pixels = 0;             ///< its error on the screen when last used
    bool empty = false;            ///< nothing answers in it
    bool stale = false;            ///< made from a state of the database that has changed here
    bool drawable() const { return slot != kNoSlot; }
  };

  TileCache(std::uint32_t slots, TilePolicy policy);

  void begin_selection() { ++selection_; }
  const Node* find(const TileKey& key) const;
  /// Keeps its slot until the next begin_selection(). REQUIRES: the node is there.
  void use(const TileKey& key, double pixels);
  std::size_t room() const;  ///< how many slots take_slot() would give to tiles that have none
  bool in_use(const Node& node) const { return node.used == selection_; }
  /// Where a tile is about to be made: its own slot if it has one, which is overwritten; kNoSlot where all
  /// are used.
  std::uint32_t take_slot(const TileKey& key);
  /// The tile is made. REQUIRES: `slot` was taken, or is kNoSlot for a tile without data.
  void put(const TileKey& key, const TileFacts& facts, std::uint32_t slot);
  /// Tiles that a change of the database reaches will be made anew; until then they are drawn as they are.
  void invalidate(const TileLattice& lattice, const Extent& place);
  void clear();

  std::uint32_t slots() const { return std::uint32_t(tiles_.size()); }
  std::uint64_t evictions() const { return evictions_; }
  /// Empty, or what is wrong with the cross-index.
  std::string find_violation() const;

 private:
  bool better_victim(const Node& a, const Node& b) const;
  void give_up(std::uint32_t slot);

  struct Slot {
    TileKey tile;
    bool taken = false, known = false;  // known: `tile` has it
  };
  std::vector<Slot> tiles_;
  std::vector<std::uint32_t> free_;
  std::unordered_map<TileKey, Node> nodes_;
  TilePolicy policy_;
  std::uint64_t selection_ = 1, evictions_ = 0;
};

}  // namespace patchwork
