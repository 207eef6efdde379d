// The R-tree over LOD space: boxes (x, y, error) in flat pages, built in bulk or changed one by one.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "db/lazy_table.h"
#include "db/lod_page.h"

namespace patchwork {

/// What a visit touched: pages, and boxes compared in them (those of nodes and of entries).
struct VisitCost {
  std::size_t nodes = 0, boxes = 0;
};

/// Keeps entries (each box sound, ids need not differ). Many may read at once; who changes it must be alone.
/// Pages of a stored tree are read when a visit first meets them.
class LodTree {
 public:
  static constexpr std::uint32_t kMaxHeight = 12;

  using Entry = LodEntry;
  struct Shape {
    int height = 1;         ///< levels of pages; 1 if the root is a leaf
    std::size_t nodes = 0;  ///< pages in use
    double fill = 0;        ///< mean share of used slots
  };
  /// What `page_bytes` gave for a page; throws where it is not to be had.
  using ReadPage = std::function<std::vector<std::byte>(std::uint32_t)>;

  LodTree();
  /// The same tree, page by page, for the same entries in the same order.
  static LodTree build(std::vector<Entry> entries);
  /// From what `header_bytes` and `page_bytes` gave; takes as long for a small tree as for a large one.
  /// Throws Error if the header is none; every later call does where it meets a page that is none.
  static LodTree open(std::span<const std::byte> header, const ReadPage& read);

  /// REQUIRES: entry.box.sound().
  void insert(const Entry& entry);
  /// Takes out one entry equal to this; false if there is none.
  bool erase(const Entry& entry);
  std::size_t size() const { return size_; }
  Shape shape() const;

  /// Calls emit(const Entry&) for every entry that meets(const LodBox&) accepts. Allocates nothing.
  /// REQUIRES: a box that contains an accepted box is accepted. CAVEAT: `emit` must not change the tree.
  template <class Meets, class Emit>
  VisitCost traverse(Meets meets, Emit emit) const {
    return walk([&](const LodPage& page, bool) { return LodHits{hits(page, meets)}; }, emit);
  }

  /// The same with hits(const LodPage&, bool inside) -> LodHits, a page at a time; `inside` is what it said
  /// of the page's own box.
  template <class Hits, class Emit>
  VisitCost visit(Hits hits, Emit emit) const {
    return walk(hits, emit);
  }
  /// The same for a uniform cut: boxes that meet the closed region, with bottom <= error < top.
  template <class Emit>
  VisitCost visit_uniform(const Extent& region, double error, Emit emit) const {
    const float limit = float_at_most(error);
    return walk([&](const LodPage& page, bool in) { return page.uniform_hits(region, limit, in); }, emit);
  }

  /// Pages written since the last call (or since the tree began), ascending, and those given up since.
  std::vector<std::uint32_t> take_dirty_pages() { return pages_.take_changed(); }
  std::vector<std::uint32_t> take_freed_pages() { return pages_.take_given_up(); }
  /// This tree is to be stored over `o`: pages that only `o` has count as given up.
  void replaces(const LodTree& o) { pages_.replaces(o.pages_); }
  /// REQUIRES: the page is in use, as those of `take_dirty_pages` are.
  std::vector<std::byte> page_bytes(std::uint32_t index) const { return pages_[index].bytes(); }
  /// Changes with every insertion and removal; the format stands in lod_tree_pages.cpp.
  std::vector<std::byte> header_bytes() const;

  /// "" if every invariant holds, else what is broken first. Reads every page.
  std::string find_violation() const;
  /// Pages in memory, and letting go of those that can be read again (who calls it must be alone).
  std::size_t loaded_pages() const { return pages_.loaded(); }
  void drop_pages() { pages_.drop_unchanged(); }

 private:
  struct Step {
    std::uint32_t page, slot;
  };
  // The way from the root (first) to a page; `slot` is the one taken, or found in the last page.
  struct Path {
    Step steps[kMaxHeight];
    std::uint32_t length = 0;
  };
  struct Orphan {
    Entry entry;
    std::uint32_t level;
  };

  template <class Meets>
  static std::uint64_t hits(const LodPage& page, Meets& meets) {
    std::uint64_t mask = 0;
    for (std::uint32_t s = 0; s < page.count; ++s) mask |= std::uint64_t{bool(meets(page.box(s)))} << s;
    return mask;
  }
  template <class Hits, class Emit>
  VisitCost walk(Hits hits, Emit& emit) const;

  static std::size_t most_pages(std::size_t in_use);
  std::uint32_t add_page(const LodPage& page);
  void release(std::uint32_t page);
  std::vector<Entry> pack(const std::vector<Entry>& entries, std::uint32_t level);
  void insert_at(const Entry& entry, std::uint32_t level);
  void grow_root(const Entry& sibling);
  bool find(std::uint32_t page, const Entry& entry, Path& path) const;
  std::vector<Orphan> condense(const Path& path);
  void shrink_root();
  void repack();
  std::string find_violation_below(std::uint32_t page, std::vector<bool>& seen, std::size_t& entries) const;

  [[noreturn]] static void refuse(const std::string& problem);

  LazyTable<LodPage> pages_;
  std::vector<std::uint32_t> free_;
  std::uint32_t root_ = 0;
  std::size_t size_ = 0;
};

template <class Hits, class Emit>
VisitCost LodTree::walk(Hits hits, Emit& emit) const {
  // The way down: pages, and what of their hits is left. Apart, because what a call returned in two registers
  // and is stored side by side makes GCC 12 wait for memory.
  const LodPage* way[kMaxHeight];
  std::uint64_t met[kMaxHeight], inside[kMaxHeight];
  VisitCost cost;
  std::uint32_t depth = 0;
  const auto enter = [&](const LodPage& page, bool all_inside) {
    ++cost.nodes, cost.boxes += page.count;
    const LodHits found = hits(page, all_inside);
    if (page.level > 0) {
      if (depth == kMaxHeight) refuse("its pages form a ring");
      way[depth] = &page, met[depth] = found.met, inside[depth] = found.inside, ++depth;
    } else {
      for (std::uint64_t left = found.met; left; left &= left - 1)
        emit(page.entry(std::uint32_t(std::countr_zero(left))));
    }
  };
  enter(pages_[root_], false);
  while (depth > 0) {
    const std::uint32_t top = depth - 1;
    if (met[top] == 0) {
      --depth;
      continue;
    }
    const auto slot = std::uint32_t(std::countr_zero(met[top]));
    met[top] &= met[top] - 1;
    if (met[top] != 0)
      if (const LodPage* next = pages_.find(way[top]->child(std::uint32_t(std::countr_zero(met[top])))))
        next->prefetch();
    enter(pages_[way[top]->child(slot)], inside[top] >> slot & 1);
  }
  return cost;
}

}  // namespace patchwork
