#include "render/tile_seams.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace patchwork {

namespace {

constexpr std::uint32_t kVertices = TileLattice::kVertices, kLast = kVertices - 1;

std::uint32_t texel(std::uint32_t slot, std::uint32_t column, std::uint32_t row) {
  return (slot * kVertices + row) * kVertices + column;
}

constexpr int opposite(int side) { return side ^ 1; }

// The children of a tile that lie along its side s, in order of position.
std::array<int, 2> along(int s) {
  constexpr std::array<int, 2> kinds[] = {{0, 2}, {1, 3}, {0, 1}, {2, 3}};
  return kinds[s];
}

class SeamMaker {
 public:
  SeamMaker(const TileLattice& lattice, const Selection& selection, const TileCache& cache, Point eye)
      : lattice_(lattice), selection_(selection), cache_(cache), eye_(eye) {}

  void make(std::vector<TileDraw>& draws, const TileGate& gate) {
    holed_.assign(selection_.leaves.size(), false), effects_.assign(selection_.leaves.size(), 0);
    bool any = false;
    for (const std::uint32_t k : selection_.drawn) {
      const TileKey& key = selection_.leaves[k].key;
      const TileFacts& facts = node(key).facts;
      any |= holed_[k] = facts.holes;
      if (gate) effects_[k] = gate(key, facts);
    }
    fill(draws);
    if (any && spread_holes(draws)) fill(draws);
  }

 private:
  const TileCache::Node& node(const TileKey& key) const { return *cache_.find(key); }

  void fill(std::vector<TileDraw>& draws) {
    order();
    const auto origin = half_cell_at(lattice_, eye_);
    draws.resize(order_.size());
    for (std::size_t d = 0; d < order_.size(); ++d) {
      TileDraw& draw = draws[d];
      const TileKey& key = selection_.leaves[order_[d]].key;
      const TileFacts& facts = node(key).facts;
      draw.x = lattice_.first_x(key) - origin[0], draw.y = lattice_.first_y(key) - origin[1];
      draw.stride = 1u << key.level, draw.slot = node(key).slot;
      draw.patches = float(facts.patches), draw.holes = holed_[order_[d]];
      draw.effects = effects_[order_[d]];
      for (int c = 0; c < 4; ++c)
        draw.corners[std::size_t(c)] = owner(key.level, key.x + (c & 1), key.y + (c >> 1));
      for (int s = 0; s < 4; ++s) make_side(key, s, draw);
    }
  }

  // A tile without holes may share vertices of one that has some. True if there is such a tile.
  bool spread_holes(const std::vector<TileDraw>& draws) {
    std::unordered_set<std::uint32_t> slots;  // of tiles with holes
    for (const TileDraw& draw : draws)
      if (draw.holes) slots.insert(draw.slot);
    bool spread = false;
    for (std::size_t d = 0; d < draws.size(); ++d) {
      const TileDraw& draw = draws[d];
      if (draw.holes) continue;
      const auto holed = [&](std::uint32_t at) { return slots.contains(at / (kVertices * kVertices)); };
      bool reads = std::any_of(draw.corners.begin(), draw.corners.end(), holed) ||
                   std::any_of(draw.middles.begin(), draw.middles.end(), holed);
      for (const TileDraw::Side& s : draw.sides) reads |= holed(s.near) || holed(s.far);
      if (reads) holed_[order_[d]] = spread = true;
    }
    return spread;
  }

  void order() {
    order_ = selection_.drawn;
    distance_.assign(selection_.leaves.size(), 0);
    for (const std::uint32_t k : order_) {
      const Extent e = lattice_.bounds(selection_.leaves[k].key);
      distance_[k] = std::hypot(std::max({e.xmin - eye_.x, eye_.x - e.xmax, 0.0}),
                                std::max({e.ymin - eye_.y, eye_.y - e.ymax, 0.0}));
    }
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      if (holed_[a] != holed_[b]) return bool(holed_[b]);
      if (effects_[a] != effects_[b]) return effects_[a] < effects_[b];
      return distance_[a] != distance_[b] ? distance_[a] < distance_[b] : a < b;
    });
    draw_of_.assign(selection_.leaves.size(), TileDraw::kAlone);
    for (std::size_t d = 0; d < order_.size(); ++d) draw_of_[order_[d]] = std::uint32_t(d);
  }

  // The texel of point (x, y), counted in tiles of a level, among the drawn tiles that have a corner there:
  // the finest, then the first. REQUIRES: one of them is drawn.
  std::uint32_t owner(int level, std::int32_t x, std::int32_t y) const {
    const Selection::Leaf* best = nullptr;
    std::uint32_t column = 0, row = 0;
    for (int q = 0; q < 4; ++q) {
      const int before_x = q & 1, before_y = q >> 1;
      const TileKey key{level, x - before_x, y - before_y};
      if (!lattice_.contains(key)) continue;
      const Selection::Leaf* leaf = selection_.leaf_at(key, before_x, before_y);
      if (!leaf || !leaf->drawn || leaf->key.level > level) continue;
      if (best && !first(leaf->key, best->key)) continue;
      best = leaf, column = before_x ? kLast : 0, row = before_y ? kLast : 0;
    }
    return best ? texel(node(best->key).slot, column, row) : 0;
  }

  static bool first(const TileKey& a, const TileKey& b) {
    if (a.level != b.level) return a.level < b.level;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  }

  // Of vertex 0 of a tile's side.
  std::uint32_t rim(const TileKey& key, int side) const {
    return texel(node(key).slot, side == 1 ? kLast : 0, side == 3 ? kLast : 0);
  }

  void make_side(const TileKey& key, int s, TileDraw& draw) const {
    const auto k = std::size_t(s);
    const TileKey other = key.beside(s);
    TileDraw::Side& side = draw.sides[k];
    side.step = s < 2 ? kVertices : 1, side.fine = 0;
    read_from(key, s, k, draw);
    draw.beside_near[k] = draw.beside_far[k] = TileDraw::kAlone;
    if (!lattice_.contains(other)) return;
    const auto at = selection_.tiles.find(other);
    if (at == selection_.tiles.end())
      beside_larger(key, s, draw);
    else if (at->second == Selection::kSplit)
      beside_finer(key, s, draw);
    else if (selection_.leaves[at->second].drawn) {
      draw.beside_near[k] = draw.beside_far[k] = draw_of_[at->second];
      if (first(other, key)) read_from(other, opposite(s), k, draw);
    }
  }

  // Side k of a draw from side s of a tile of its level.
  void read_from(const TileKey& key, int s, std::size_t k, TileDraw& draw) const {
    TileDraw::Side& side = draw.sides[k];
    side.near = rim(key, s), side.far = side.near + (kLast / 2) * side.step;
    draw.middles[k] = side.far;
  }

  void beside_larger(const TileKey& key, int s, TileDraw& draw) const {
    const auto at = selection_.tiles.find(key.beside(s).parent());
    if (at == selection_.tiles.end() || at->second == Selection::kSplit) return;
    if (!selection_.leaves[at->second].drawn) return;
    const bool second = (s < 2 ? key.y : key.x) & 1;
    draw.beside_near[std::size_t(s)] = draw.beside_far[std::size_t(s)] =
        draw_of_[at->second] | TileDraw::kLarger | (second ? TileDraw::kSecondHalf : 0);
  }

  // A half beside which nothing is drawn keeps its own vertices: at every other position.
  void beside_finer(const TileKey& key, int s, TileDraw& draw) const {
    const auto k = std::size_t(s);
    TileDraw::Side& side = draw.sides[k];
    const TileKey other = key.beside(s);
    std::uint32_t* const texels[] = {&side.near, &side.far};
    std::uint32_t* const draws[] = {&draw.beside_near[k], &draw.beside_far[k]};
    for (int h = 0; h < 2; ++h) {
      const TileKey child = other.child(along(opposite(s))[std::size_t(h)]);
      const auto at = selection_.tiles.find(child);
      if (at == selection_.tiles.end() || at->second == Selection::kSplit) continue;
      if (!selection_.leaves[at->second].drawn) continue;
      *texels[h] = rim(child, opposite(s)), *draws[h] = draw_of_[at->second] | TileDraw::kFiner;
      side.fine |= 1u << h;
    }
    if (side.fine == 0) return;
    const std::int32_t x = 2 * key.x + (s < 2 ? 2 * (s == 1) : 1), y = 2 * key.y + (s < 2 ? 1 : 2 * (s == 3));
    draw.middles[k] = owner(key.level - 1, x, y);
  }

  const TileLattice& lattice_;
  const Selection& selection_;
  const TileCache& cache_;
  Point eye_;
  std::vector<std::uint32_t> order_, draw_of_;  // places of leaves by draw; draws by place
  std::vector<double> distance_;
  std::vector<bool> holed_;             // leaves that may have a vertex without data
  std::vector<std::uint32_t> effects_;  // of leaves
};

}  // namespace

std::array<std::int32_t, 2> half_cell_at(const TileLattice& lattice, Point p) {
  const auto cell = [&](double v, double from) {
    return std::int32_t(std::clamp(std::floor((v - from) / lattice.half_cell()), -0x1p29, 0x1p29));
  };
  return {cell(p.x, lattice.origin().x), cell(p.y, lattice.origin().y)};
}

void make_draws(const TileLattice& lattice, const Selection& selection, const TileCache& cache, Point eye,
                std::vector<TileDraw>& draws, const TileGate& gate) {
  SeamMaker(lattice, selection, cache, eye).make(draws, gate);
}

}  // namespace patchwork
