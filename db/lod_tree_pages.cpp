// The R-tree as bytes, and what must hold of it.
#include <string>

#include "db/error.h"
#include "db/little_endian.h"
#include "db/lod_tree.h"

// The header, format 2, all little-endian: u32 format, u32 root page, u32 height, u64 entries, u32 pages
// (used and free ones), then the free ones' numbers, u32 each.

namespace patchwork {

namespace {

constexpr std::uint32_t kFormat = 2;
constexpr std::size_t kHeaderBytes = 24;
constexpr std::size_t kMostPages = std::size_t{1} << 24;  // 10^9 boxes; what a hostile header may ask for

std::string name(std::uint32_t page) { return "page " + std::to_string(page); }

}  // namespace

void LodTree::refuse(const std::string& problem) {
  throw Error("R-tree", problem, "run `patchwork check --repair`: it is made of the patches");
}

std::vector<std::byte> LodTree::header_bytes() const {
  std::vector<std::byte> out;
  put_little(out, kFormat), put_little(out, root_), put_little(out, pages_[root_].level + 1);
  put_little(out, std::uint64_t{size_}), put_little(out, std::uint32_t(pages_.size()));
  for (const std::uint32_t page : free_) put_little(out, page);
  return out;
}

LodTree LodTree::open(std::span<const std::byte> header, const ReadPage& read) {
  const auto u32 = [&](std::size_t at) { return get_little<std::uint32_t>(header.data() + at); };
  if (header.size() < kHeaderBytes || header.size() % 4 || u32(0) != kFormat)
    refuse("its header has an unknown format");
  LodTree tree;
  const std::size_t size = u32(20), free = (header.size() - kHeaderBytes) / 4;
  tree.root_ = u32(4), tree.size_ = get_little<std::uint64_t>(header.data() + 12);
  if (free >= size || size > kMostPages || size > most_pages(size - free) || size - free > tree.size_ + 1)
    refuse("its header states an impossible size");
  if (tree.root_ >= size) refuse("the root is no page");
  tree.free_.clear();
  for (std::size_t at = kHeaderBytes; at < header.size(); at += 4) {
    tree.free_.push_back(u32(at));
    if (tree.free_.back() >= size) refuse("its header names a free page that is none");
  }
  const std::uint32_t height = u32(8);
  tree.pages_ = LazyTable<LodPage>(size, [read, height, size](std::size_t index) {
    std::string problem;
    auto page = std::make_unique<LodPage>(LodPage::from_bytes(read(std::uint32_t(index)), problem));
    if (problem.empty() && page->level >= height) problem = "has another level than its place";
    for (std::uint32_t s = 0; problem.empty() && page->level > 0 && s < page->count; ++s)
      if (page->ref[s] >= size) problem = "refers to a page that is none";
    if (!problem.empty()) refuse(name(std::uint32_t(index)) + " " + problem);
    return page;
  });
  if (height != tree.pages_[tree.root_].level + 1) refuse("its header states another height");
  return tree;
}

std::string LodTree::find_violation() const {
  if (root_ >= pages_.size() || pages_[root_].level >= kMaxHeight) return "the root is no page";
  if (pages_.size() > most_pages(pages_.size() - free_.size())) return "too few of its pages are in use";
  std::vector<bool> seen(pages_.size());
  for (const std::uint32_t page : free_) {
    if (seen[page]) return name(page) + " is free twice";
    seen[page] = true;
  }
  if (seen[root_]) return "the root is free";
  seen[root_] = true;
  std::size_t entries = 0;
  if (std::string violation = find_violation_below(root_, seen, entries); !violation.empty())
    return violation;
  for (std::uint32_t page = 0; page < pages_.size(); ++page)
    if (!seen[page]) return name(page) + " hangs on no other";
  if (entries != size_) return std::to_string(entries) + " entries instead of " + std::to_string(size_);
  return {};
}

// Levels fall by one at each step, so this ends even on pages that form a ring.
std::string LodTree::find_violation_below(std::uint32_t index, std::vector<bool>& seen,
                                          std::size_t& entries) const {
  const LodPage& page = pages_[index];
  const std::uint32_t least = index != root_ ? LodPage::kMinSlots : page.level > 0 ? 2 : 0;
  if (page.count < least || page.count > LodPage::kSlots)
    return name(index) + " has " + std::to_string(page.count) + " entries";
  for (std::uint32_t s = 0; s < page.count; ++s) {
    if (!page.box(s).sound()) return name(index) + " holds a box that is none";
    if (page.level == 0) continue;
    if (page.ref[s] >= pages_.size()) return name(index) + " refers to a page that is none";
    const std::uint32_t child = page.child(s);
    if (seen[child]) return name(child) + " is used twice, or free and used";
    seen[child] = true;
    if (pages_[child].level + 1 != page.level) return name(child) + " has another level than its place";
    if (std::string below = find_violation_below(child, seen, entries); !below.empty()) return below;
    if (!(pages_[child].bounds() == page.box(s)))
      return name(index) + " has a box that is not tight around " + name(child);
  }
  if (page.level == 0) entries += page.count;
  return {};
}

}  // namespace patchwork
