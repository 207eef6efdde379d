// The R-tree as bytes, and what must hold of it.
#include <string>

#include "db/error.h"
#include "db/lod_tree.h"

// The header, format 1, all little-endian: u32 format, u32 root page, u32 height, u64 entries. Pages that are
// not stored are free.

namespace patchwork {

namespace {

constexpr std::uint64_t kFormat = 1;
constexpr std::size_t kHeaderBytes = 20;

void put(std::vector<std::byte>& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(std::byte(value >> 8 * i));
}

std::uint64_t get(std::span<const std::byte> from, std::size_t at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::uint64_t(from[at + i]) << 8 * i;
  return value;
}

[[noreturn]] void refuse(const std::string& problem) {
  throw Error("R-tree", problem, "run `patchwork check`, and import again if the file is damaged");
}

std::string name(std::uint32_t page) { return "page " + std::to_string(page); }

}  // namespace

std::vector<std::byte> LodTree::header_bytes() const {
  std::vector<std::byte> out;
  put(out, kFormat, 4), put(out, root_, 4), put(out, pages_[root_].level + 1, 4), put(out, size_, 8);
  return out;
}

LodTree LodTree::from_pages(std::span<const std::byte> header, std::span<const StoredPage> pages) {
  if (header.size() != kHeaderBytes || get(header, 0, 4) != kFormat)
    refuse("its header has an unknown format");
  LodTree tree;
  tree.pages_.clear(), tree.marks_.clear();
  for (const StoredPage& stored : pages) {
    if (stored.index >= most_pages(pages.size())) refuse(name(stored.index) + " has too high a number");
    if (stored.index >= tree.pages_.size()) tree.pages_.resize(stored.index + std::size_t{1});
    if (tree.pages_[stored.index].level != LodPage::kFree) refuse(name(stored.index) + " is stored twice");
    std::string problem;
    tree.pages_[stored.index] = LodPage::from_bytes(stored.bytes, problem);
    if (!problem.empty()) refuse(name(stored.index) + " " + problem);
  }
  for (std::size_t i = tree.pages_.size(); i-- > 0;)
    if (tree.pages_[i].level == LodPage::kFree) tree.free_.push_back(std::uint32_t(i));
  tree.marks_.resize(tree.pages_.size());
  tree.root_ = std::uint32_t(get(header, 4, 4));
  tree.size_ = std::size_t(get(header, 12, 8));
  const std::string violation = tree.find_violation();
  if (!violation.empty()) refuse(violation);
  if (get(header, 8, 4) != tree.pages_[tree.root_].level + 1) refuse("its header states another height");
  return tree;
}

std::string LodTree::find_violation() const {
  if (root_ >= pages_.size() || pages_[root_].level >= kMaxHeight) return "the root is no page";
  if (pages_.size() > most_pages(pages_.size() - free_.size())) return "too few of its pages are in use";
  std::vector<bool> seen(pages_.size());
  for (const std::uint32_t page : free_) {
    if (seen[page] || pages_[page].level != LodPage::kFree)
      return name(page) + " is free, but in use or free twice";
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
