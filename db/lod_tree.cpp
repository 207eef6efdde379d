#include "db/lod_tree.h"

#include <algorithm>
#include <cassert>

#include "db/lod_tree_tiling.h"

namespace patchwork {

namespace {

// Pages built in bulk keep room for four boxes: the first insertions near by then split nothing.
constexpr std::size_t kBulkSlots = LodPage::kSlots - 4;

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
  tile(entries, pages, [&](std::span<const std::uint32_t> part) {
    LodPage page(level);
    for (const std::uint32_t t : part) page.append(entries[t]);
    const LodBox bounds = page.bounds();
    above.push_back({bounds, {add_page(page)}});
  });
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
