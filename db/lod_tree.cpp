#include "db/lod_tree.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace patchwork {

namespace {

// Pages built in bulk keep room for four boxes: the first insertions near by then split nothing.
constexpr std::size_t kBulkSlots = LodPage::kSlots - 4;

// How much rather errors are parted than places: a large coarse box among small fine ones widens their whole
// page. On a pyramid of 458 000 boxes the factors 1, 8, 32, 512 read 17, 15, 14, 40 pages at a point (mean
// over three errors), and 142, 107, 23, 51 for a coarse view of a region.
constexpr double kErrorFirst = 32;

// A box to be tiled: centre and size (metres from the corner of all boxes; octaves), and which entry it is.
struct Tile {
  std::array<float, 3> centre, size;
  std::uint32_t index;
};

std::vector<Tile> tiles_of(const std::vector<LodEntry>& entries) {
  LodBox all = entries[0].box;
  for (const LodEntry& e : entries) all = united(all, e.box);
  std::vector<Tile> tiles;
  tiles.reserve(entries.size());
  for (const LodEntry& e : entries) {
    const LodBox& b = e.box;
    const float low = error_octaves(b.bottom), high = error_octaves(b.top);
    tiles.push_back({{float(0.5 * (b.xmin + b.xmax) - all.xmin), float(0.5 * (b.ymin + b.ymax) - all.ymin),
                      0.5f * (low + high)},
                     {float(b.xmax - b.xmin), float(b.ymax - b.ymin), high - low},
                     std::uint32_t(tiles.size())});
  }
  return tiles;
}

// The axis along which the most boxes of mean size lie side by side: cutting there overlaps least.
std::size_t axis_to_cut(std::span<const Tile> tiles) {
  std::array<float, 3> low = tiles[0].centre, high = low;
  std::array<double, 3> sizes{};
  for (const Tile& t : tiles)
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], t.centre[a]), high[a] = std::max(high[a], t.centre[a]);
      sizes[a] += double(t.size[a]);
    }
  std::array<double, 3> side_by_side;
  for (std::size_t a = 0; a < 3; ++a)
    side_by_side[a] = double(high[a] - low[a]) / (sizes[a] / double(tiles.size()) + 1e-9);
  side_by_side[2] *= kErrorFirst;
  return std::size_t(std::max_element(side_by_side.begin(), side_by_side.end()) - side_by_side.begin());
}

// Sort-tile-recursive (Leutenegger et al. 1997) with halves instead of slabs, so that each part chooses its
// own axis: calls done(part) for `pages` parts of equal size (to one), in an order that keeps neighbours
// together.
template <class Done>
void tile(std::span<Tile> tiles, std::size_t pages, Done& done) {
  if (pages <= 1) return done(tiles);
  const std::size_t axis = axis_to_cut(tiles), half = pages / 2, cut = tiles.size() * half / pages;
  const auto before = [axis](const Tile& a, const Tile& b) {
    return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.index < b.index;
  };
  std::nth_element(tiles.begin(), tiles.begin() + std::ptrdiff_t(cut), tiles.end(), before);
  tile(tiles.first(cut), half, done);
  tile(tiles.subspan(cut), pages - half, done);
}

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
  std::vector<Tile> tiles = tiles_of(entries);
  const std::size_t pages = (entries.size() + kBulkSlots - 1) / kBulkSlots;
  std::vector<Entry> above;
  const auto done = [&](std::span<const Tile> part) {
    LodPage page(level);
    for (const Tile& t : part) page.append(entries[t.index]);
    const LodBox bounds = page.bounds();
    above.push_back({bounds, {add_page(page)}});
  };
  tile(std::span<Tile>(tiles), pages, done);
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
