// What a grid's coming or going does to the others: tops and flags are evaluated anew where it lies, and the
// R-tree and the store follow.
#pragma once

#include <string>
#include <vector>

#include "db/database_impl.h"
#include "db/invariant.h"

namespace patchwork {

/// Changes to the loaded state within one write transaction. Work grows with the grid and what it overlaps.
class Restate {
 public:
  explicit Restate(Database::Impl& db) : db_(db) {}

  /// Counts over all changes so far. `added` patches are those of grids that came.
  struct Effect {
    std::size_t added = 0, dormant = 0, removed = 0;             ///< dormant: of the added
    std::size_t hidden = 0, lowered = 0, woken = 0, raised = 0;  ///< of other grids
  };
  const Effect& effect() const { return effect_; }

  /// The grid joins the others; its id is the store's. Tops and flags of its records are overwritten.
  void add(Grid grid);
  void remove(std::size_t place);
  /// Evaluates every patch and builds the R-tree from nothing; returns how many records changed.
  std::size_t everything();
  /// Writes what changed, and the next version with a note of `what` changed. Where: the grids that came or
  /// went, and the patches of others whose tops or flags changed, which may lie partly beside these.
  void store(const std::string& what);

 private:
  std::vector<PatchPlace> places_near(const Extent& extent, std::size_t all_of) const;
  std::size_t evaluate(std::vector<PatchPlace> places, std::size_t added);
  void note(const PatchRecord& before, const PatchRecord& after, const LodBox& box);
  void change_tree();
  void forget_lists();

  Database::Impl& db_;
  Effect effect_;
  std::vector<LodEntry> out_, in_;  // of the R-tree
  bool rebuilt_ = false;
  Extent where_ = Extent::nothing();
};

/// Entries of the R-tree as the records have them; room for `about` as many is made beforehand.
std::vector<LodEntry> live_entries(std::span<const Grid> grids, std::size_t about = 0);

}  // namespace patchwork
