#include "db/lod_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace patchwork {

namespace {

// Pages built in bulk keep room for four boxes: the first insertions near by then split nothing.
constexpr std::size_t kBulkSlots = LodPage::kSlots - 4;

// What a page is taken to cost: how likely a question reads it, by its box. Of the questions, one in five
// asks for an error, any octave alike, over a square of a tenth of the extent; the others are views from
// anywhere, which allow kNearest times the distance from the eye, or a power of kNext times as much.
constexpr double kUniform = 0.2, kSide = 0.1;
constexpr double kNearest = 0x1p-10, kNext = 4;
constexpr int kSlopes = 4;

// A box to be tiled: the box; by what it may be sorted (centre in x and y, metres from the corner of all
// boxes; middle, top and bottom of its errors, octaves); and which entry it is.
struct Tile {
  static constexpr std::size_t kKeys = 5;
  LodBox box;
  std::array<float, kKeys> keys;
  std::uint32_t index;
};

class Tiling {
 public:
  explicit Tiling(const std::vector<LodEntry>& entries) {
    LodBox all = entries[0].box;
    for (const LodEntry& e : entries) all = united(all, e.box);
    width_ = all.xmax - all.xmin, height_ = all.ymax - all.ymin;
    tiles_.reserve(entries.size());
    for (const LodEntry& e : entries) {
      const LodBox& b = e.box;
      const float low = error_octaves(b.bottom), high = error_octaves(b.top);
      lowest_ = std::min(lowest_, high), highest_ = std::max(highest_, std::isfinite(b.top) ? high : low);
      tiles_.push_back({b,
                        {float(0.5 * (b.xmin + b.xmax) - all.xmin), float(0.5 * (b.ymin + b.ymax) - all.ymin),
                         0.5f * (low + high), high, low},
                        std::uint32_t(tiles_.size())});
    }
  }

  // Calls done(part) for `pages` parts of about equal size, in an order that keeps neighbours together.
  template <class Done>
  void split(std::size_t pages, Done done) {
    split(std::span<Tile>(tiles_), pages, done);
  }

 private:
  // Greedy from the top (Garcia, Lopez and Leutenegger 1998, "A greedy algorithm for bulk loading R-trees"),
  // with a cost that knows cuts: of the ways to part the tiles in two, along each key and at each of three
  // shares, the one whose parts cost least.
  template <class Done>
  void split(std::span<Tile> tiles, std::size_t pages, Done& done) {
    if (pages <= 1) return done(tiles);
    double least = INFINITY;
    std::size_t key = 0, first = 0;
    for (std::size_t k = 0; k < Tile::kKeys; ++k)
      for (const double share : {0.5, 0.25, 0.75}) {
        const auto part = std::clamp<std::size_t>(std::size_t(share * double(pages) + 0.5), 1, pages - 1);
        const std::size_t cut = part_by(tiles, k, part, pages);
        const double cost = double(part) * this->cost(tiles.first(cut)) +
                            double(pages - part) * this->cost(tiles.subspan(cut));
        if (cost < least) least = cost, key = k, first = part;
        if (pages == 2) break;
      }
    const std::size_t cut = part_by(tiles, key, first, pages);
    split(tiles.first(cut), first, done);
    split(tiles.subspan(cut), pages - first, done);
  }

  // The tiles of the first `part` pages of `pages`, by a key, to the front; returns how many.
  static std::size_t part_by(std::span<Tile> tiles, std::size_t key, std::size_t part, std::size_t pages) {
    const std::size_t cut = tiles.size() * part / pages;
    std::nth_element(tiles.begin(), tiles.begin() + std::ptrdiff_t(cut), tiles.end(),
                     [key](const Tile& a, const Tile& b) {
                       return a.keys[key] != b.keys[key] ? a.keys[key] < b.keys[key] : a.index < b.index;
                     });
    return cut;
  }

  double cost(std::span<const Tile> tiles) const {
    LodBox b = tiles[0].box;
    for (const Tile& t : tiles) b = united(b, t.box);
    const double extent = width_ * height_ + 1e-9;
    const double w = b.xmax - b.xmin, h = b.ymax - b.ymin;
    const double octaves =
        double(std::min(error_octaves(b.top), highest_) - std::max(error_octaves(b.bottom), lowest_ - 1));
    const double uniform = std::min(1.0, (w + kSide * width_) * (h + kSide * height_) / extent) *
                           std::max(0.0, octaves) / double(highest_ - lowest_ + 1);
    double views = 0, slope = kNearest;
    for (int n = 0; n < kSlopes; ++n, slope *= kNext) {
      // Where the eye may be: near enough for the smallest error, not so near that the largest is too much.
      const double far = std::min(double(b.top) / slope, 2 * (width_ + height_));
      const double near = std::max(0.0, double(b.bottom) / slope - 0.5 * std::hypot(w, h));
      const double reached = std::min(extent, w * h + 2 * (w + h) * far + M_PI * far * far);
      views += std::max(0.0, reached - M_PI * near * near) / extent / kSlopes;
    }
    return kUniform * uniform + (1 - kUniform) * views;
  }

  std::vector<Tile> tiles_;
  double width_ = 0, height_ = 0;                  // metres, of all boxes
  float lowest_ = INFINITY, highest_ = -INFINITY;  // octaves: of the tops, of finite ones
};

}  // namespace

LodTree::LodTree() { root_ = add_page(LodPage(0)); }

LodTree LodTree::build(std::vector<Entry> entries) {
  LodTree tree;
  if (entries.empty()) return tree;
  tree.release(tree.root_);
  tree.size_ = entries.size();
  std::uint32_t level = 0;
  do entries = tree.pack(entries, level++);
  while (entries.size() > 1);
  tree.root_ = std::uint32_t(entries[0].id.value);
  return tree;
}

// Makes the pages of one level and returns their entries for the level above.
std::vector<LodTree::Entry> LodTree::pack(const std::vector<Entry>& entries, std::uint32_t level) {
  const std::size_t pages = (entries.size() + kBulkSlots - 1) / kBulkSlots;
  std::vector<Entry> above;
  const auto done = [&](std::span<const Tile> part) {
    LodPage page(level);
    for (const Tile& t : part) page.append(entries[t.index]);
    const LodBox bounds = page.bounds();
    above.push_back({bounds, {add_page(page)}});
  };
  Tiling(entries).split(pages, done);
  return above;
}

std::uint32_t LodTree::add_page(const LodPage& page) {
  if (free_.empty()) free_.push_back(std::uint32_t(pages_.size()));
  const std::uint32_t index = free_.back();
  free_.pop_back();
  pages_.put(index, std::make_unique<LodPage>(page));
  return index;
}

void LodTree::release(std::uint32_t page) {
  pages_.give_up(page);
  free_.push_back(page);
}

void LodTree::insert(const Entry& entry) {
  assert(entry.box.sound());
  insert_at(entry, 0);
  ++size_;
}

// Down along the boxes that grow least, growing them; then up, as long as pages split.
void LodTree::insert_at(const Entry& entry, std::uint32_t level) {
  Path path;
  std::uint32_t at = root_;
  while (pages_[at].level > level) {
    const LodPage& page = pages_[at];
    if (path.length == kMaxHeight) refuse("its pages form a ring");
    const std::uint32_t slot = page.choose_slot(entry.box);
    const LodBox old = page.box(slot), grown = united(old, entry.box);
    if (!(grown == old)) pages_.change(at).set_box(slot, grown);
    path.steps[path.length++] = {at, slot};
    at = page.child(slot);
  }
  Entry pending = entry;
  while (pages_[at].count == LodPage::kSlots) {
    const LodPage part = pages_.change(at).split(pending);
    pending = {part.bounds(), {add_page(part)}};
    if (path.length == 0) return grow_root(pending);
    const Step up = path.steps[--path.length];
    pages_.change(up.page).set_box(up.slot, pages_[at].bounds());
    at = up.page;
  }
  pages_.change(at).append(pending);
}

void LodTree::grow_root(const Entry& sibling) {
  LodPage page(pages_[root_].level + 1);
  assert(page.level < kMaxHeight);
  page.append({pages_[root_].bounds(), {root_}});
  page.append(sibling);
  root_ = add_page(page);
}

bool LodTree::erase(const Entry& entry) {
  Path path;
  if (!find(root_, entry, path)) return false;
  --size_;
  std::vector<Orphan> orphans = condense(path);
  // Whole subtrees first: entries then find the boxes that they are to join.
  std::stable_sort(orphans.begin(), orphans.end(),
                   [](const Orphan& a, const Orphan& b) { return a.level > b.level; });
  for (const Orphan& o : orphans) insert_at(o.entry, o.level);
  shrink_root();
  if (pages_.size() > most_pages(pages_.size() - free_.size())) repack();
  return true;
}

// Leaves in `path` the way to the entry.
bool LodTree::find(std::uint32_t page, const Entry& entry, Path& path) const {
  const LodPage& p = pages_[page];
  if (path.length == kMaxHeight) refuse("its pages form a ring");
  const std::uint32_t depth = path.length++;
  for (std::uint32_t s = 0; s < p.count; ++s) {
    path.steps[depth] = {page, s};
    if (p.level == 0 ? p.entry(s) == entry : contains(p.box(s), entry.box) && find(p.child(s), entry, path))
      return true;
  }
  path.length = depth;
  return false;
}

// Takes out what `path` leads to, gives up pages that are left too empty, and tightens the boxes above.
// Returns the entries of the pages given up.
std::vector<LodTree::Orphan> LodTree::condense(const Path& path) {
  std::vector<Orphan> orphans;
  bool take_out = true;
  for (std::uint32_t depth = path.length; depth-- > 0;) {
    const auto [index, slot] = path.steps[depth];
    const LodPage& page = pages_[index];
    if (take_out) {
      pages_.change(index).remove(slot);
    } else {
      const LodBox tight = pages_[page.child(slot)].bounds();
      if (tight == page.box(slot)) break;
      pages_.change(index).set_box(slot, tight);
    }
    take_out = depth > 0 && page.count < LodPage::kMinSlots;
    if (!take_out) continue;
    for (std::uint32_t s = 0; s < page.count; ++s) orphans.push_back({page.entry(s), page.level});
    release(index);
  }
  return orphans;
}

void LodTree::shrink_root() {
  while (pages_[root_].level > 0 && pages_[root_].count == 1) {
    const std::uint32_t child = pages_[root_].child(0);
    release(root_);
    root_ = child;
  }
}

// How many pages there may be, used or free: a bound that files are held to as well, so that a hostile page
// number cannot ask for memory.
std::size_t LodTree::most_pages(std::size_t in_use) { return 4096 + 64 * in_use; }

// After most of a large tree is gone its few pages lie far apart: builds it anew from page 0 on.
void LodTree::repack() {
  std::vector<Entry> entries;
  entries.reserve(size_);
  traverse([](const LodBox&) { return true; }, [&](const Entry& e) { entries.push_back(e); });
  LodTree packed = build(std::move(entries));
  packed.replaces(*this);
  *this = std::move(packed);
}

// Every page but the root is an entry of another, so no page has to be read to know the fill.
LodTree::Shape LodTree::shape() const {
  const std::size_t nodes = pages_.size() - free_.size();
  return {int(pages_[root_].level) + 1, nodes, double(size_ + nodes - 1) / double(nodes * LodPage::kSlots)};
}

}  // namespace patchwork
