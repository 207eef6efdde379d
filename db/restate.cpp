#include "db/restate.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "db/error.h"

namespace patchwork {

namespace {

// Below this share of changed boxes the tree is changed box by box, above it is packed anew.
constexpr double kRebuildShare = 0.25;
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

double smallest_bottom(const Grid& grid) {
  double least = std::numeric_limits<double>::infinity();
  grid.patches.each([&](std::size_t, const PatchRecord& p) {
    if (p.exists()) least = std::min(least, p.bottom);
  });
  return least;
}

LodEntry entry_of(const Grid& g, std::size_t k) { return {lod_box(g, k), g.patch_id(k)}; }

}  // namespace

std::vector<LodEntry> live_entries(std::span<const Grid> grids, std::size_t about) {
  std::vector<LodEntry> all;
  all.reserve(about);
  for (const Grid& g : grids)
    g.patches.each([&](std::size_t k, const PatchRecord& p) {
      if (p.exists() && !p.dormant()) all.push_back({lod_box(g.info, k, p), g.patch_id(k)});
    });
  return all;
}

// A patch that cannot change is left out. A grid that comes lowers tops to its own bottoms and no further,
// and ends that others are best; one that goes raises only tops that were not below all its bottoms, and only
// those become best that were not and had a better one in it.
std::vector<PatchPlace> Restate::places_near(const Extent& extent, std::size_t all_of) const {
  std::vector<PatchPlace> places;
  for (std::size_t g = 0; g < db_.grids.size(); ++g) {
    const Grid& grid = db_.grids[g];
    if (g == all_of) {
      grid.patches.each([&](std::size_t k, const PatchRecord& p) {
        if (p.exists()) places.push_back({g, k});
      });
      continue;
    }
    if (!grid.info.bounds().meets(extent)) continue;
    for (int l = 0; l < grid.info.shape.levels(); ++l) {
      const BlockRange r = blocks_near(grid.info, l, extent);
      for (int by = r.j0; by <= r.j1; ++by)
        for (int bx = r.i0; bx <= r.i1; ++bx) {
          const std::size_t k = grid.info.shape.index(l, bx, by);
          if (grid.patches[k].exists() &&
              grid.info.frame.bounds(grid.info.shape.kernel(l, bx, by)).meets(extent))
            places.push_back({g, k});
        }
    }
  }
  return places;
}

void Restate::add(Grid grid) {
  const Extent extent = grid.info.bounds();
  where_.add(extent);
  const double least = smallest_bottom(grid);
  const auto place = std::lower_bound(db_.grids.begin(), db_.grids.end(), grid.info.id,
                                      [](const Grid& g, GridId id) { return g.info.id < id; });
  const auto added = std::size_t(place - db_.grids.begin());
  db_.grids.insert(place, std::move(grid));
  std::vector<PatchPlace> places = places_near(extent, added);
  std::erase_if(places, [&](const PatchPlace& at) {
    const PatchRecord& p = db_.grids[at.grid].patches[at.index];
    return at.grid != added && !p.best() && p.top <= least;
  });
  evaluate(std::move(places), added);
  change_tree();
}

void Restate::remove(std::size_t place) {
  const Grid gone = std::move(db_.grids[place]);
  const Extent extent = gone.info.bounds();
  where_.add(extent);
  double least = -std::numeric_limits<double>::infinity();
  try {
    gone.patches.each([&](std::size_t k, const PatchRecord& p) {
      effect_.removed += p.exists();
      if (p.exists() && !p.dormant()) out_.push_back({lod_box(gone.info, k, p), gone.patch_id(k)});
    });
    least = smallest_bottom(gone);
  } catch (const Error&) {  // a grid with damaged records must be able to go: the tree knows its boxes
    out_.clear();
    db_.tree.traverse([](const LodBox&) { return true; },
                      [&](const LodEntry& e) {
                        if (e.id.grid() == gone.info.id) out_.push_back(e);
                      });
  }
  db_.grids.erase(db_.grids.begin() + std::ptrdiff_t(place));
  std::vector<PatchPlace> places = places_near(extent, kNone);
  std::erase_if(places, [&](const PatchPlace& at) {
    const PatchRecord& p = db_.grids[at.grid].patches[at.index];
    return p.top < least && (p.best() || p.bottom < least);
  });
  db_.store->remove_grid(gone.info.id);
  for (const Store::Kind kind : {Store::Kind::records, Store::Kind::payload})
    db_.store->erase_blobs(kind, first_key(gone.info.id), end_key(gone.info.id));
  db_.forget_heights({gone.info.id});  // the next grid may get its id
  evaluate(std::move(places), kNone);
  change_tree();
}

std::size_t Restate::everything() {
  std::vector<PatchPlace> places;
  for (std::size_t g = 0; g < db_.grids.size(); ++g)
    db_.grids[g].patches.each([&](std::size_t k, const PatchRecord& p) {
      if (p.exists()) places.push_back({g, k});
    });
  const std::size_t changed = evaluate(std::move(places), kNone);
  for (const Grid& g : db_.grids) where_.add(g.info.bounds());
  forget_lists();
  db_.tree = LodTree::build(live_entries(db_.grids)), db_.tree_damage.reset();
  rebuilt_ = true;
  return changed;
}

std::size_t Restate::evaluate(std::vector<PatchPlace> places, std::size_t added) {
  std::vector<Standing> standings(places.size());
  tbb::enumerable_thread_specific<CoverageCounts> counts;
  tbb::parallel_for(size_t(0), places.size(),
                    [&](std::size_t k) { standings[k] = standing(db_.grids, places[k], counts.local()); });
  for (const CoverageCounts& c : counts) db_.counts += c;
  std::size_t changed = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto [g, index] = places[k];
    Grid& grid = db_.grids[g];
    const PatchRecord before = grid.patches[index];
    PatchRecord after = before;
    after.top = standings[k].top;
    after.flags = (before.flags & ~std::uint64_t{PatchRecord::kBest}) |
                  (standings[k].best ? std::uint64_t{PatchRecord::kBest} : 0);
    if (after == before && g != added) continue;
    ++changed;
    if (g != added && !before.dormant()) out_.push_back(entry_of(grid, index));
    grid.patches.change(index) = after;
    if (!after.dormant()) in_.push_back(entry_of(grid, index));
    if (g == added)
      ++effect_.added, effect_.dormant += after.dormant();
    else
      note(before, after, lod_box(grid.info, index, after));
  }
  return changed;
}

void Restate::note(const PatchRecord& before, const PatchRecord& after, const LodBox& box) {
  if (!before.dormant() || !after.dormant()) where_.add({box.xmin, box.ymin, box.xmax, box.ymax});
  effect_.lowered += after.top < before.top;
  effect_.raised += after.top > before.top;
  effect_.hidden += after.dormant() && !before.dormant();
  effect_.woken += before.dormant() && !after.dormant();
}

void Restate::change_tree() {
  if (out_.empty() && in_.empty()) return;
  if (double(out_.size() + in_.size()) < kRebuildShare * double(db_.tree.size())) {
    for (const LodEntry& e : out_)
      if (!db_.tree.erase(e))
        throw Error(db_.store->path(), "the R-tree lacks a patch", "run: patchwork check --repair");
    for (const LodEntry& e : in_) db_.tree.insert(e);
  } else {
    // Nothing else may take memory beside what becomes of a large tree: with its lists kept, and entries
    // copied, importing 16385 x 16385 samples took 190 MB at its peak, without 160.
    const std::size_t live = std::max(db_.tree.size(), out_.size()) - out_.size() + in_.size();
    forget_lists();
    db_.tree = LodTree::build(live_entries(db_.grids, live));
    rebuilt_ = true;
  }
  forget_lists();
}

void Restate::forget_lists() { std::vector<LodEntry>().swap(out_), std::vector<LodEntry>().swap(in_); }

void Restate::store(const std::string& what) {
  Store& store = *db_.store;
  for (Grid& g : db_.grids)
    for (const std::uint32_t run : g.patches.runs().take_changed())
      store.put_blob(Store::Kind::records, first_key(g.info.id) | run, g.patches.runs()[run].bytes());
  if (rebuilt_) store.erase_blobs(Store::Kind::tree_page, 0, tree_page_key(~std::uint32_t{0}));
  for (const std::uint32_t page : db_.tree.take_dirty_pages())
    store.put_blob(Store::Kind::tree_page, tree_page_key(page), db_.tree.page_bytes(page));
  for (const std::uint32_t page : db_.tree.take_freed_pages())
    store.erase_blobs(Store::Kind::tree_page, tree_page_key(page), tree_page_key(page) + 1);
  store.put_blob(Store::Kind::tree_page, 0, db_.tree.header_bytes());
  store.set_fact("decided_integer", std::to_string(db_.counts.integer));
  store.set_fact("decided_interval", std::to_string(db_.counts.interval));
  store.set_fact("decided_exact", std::to_string(db_.counts.exact));
  store.set_fact("version", std::to_string(++db_.version));
  store.note_change({db_.version, what, where_});
}

}  // namespace patchwork
