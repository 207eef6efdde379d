// Everything that must hold of a database, looked at without trusting any of it.
#include "db/check.h"

#include <fmt/format.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "db/database_impl.h"
#include "db/error.h"
#include "db/restate.h"

namespace patchwork {

namespace {

constexpr std::size_t kMostOfAKind = 20;  // problems of one kind that are listed one by one
constexpr Store::Kind kOfGrids[] = {Store::Kind::records, Store::Kind::payload};

// Shares of the time that the parts took on a grid of 16385 x 16385.
constexpr double kPayloadShare = 0.6, kStandingShare = 0.35;

class Checker {
 public:
  Checker(Database::Impl& db, const Progress& progress) : db_(db), progress_(progress) {}

  std::vector<Problem> run() {
    check_store();
    for (const Grid& g : db_.grids) check_records(g);
    check_payloads();
    if (records_sound_) check_standings();
    check_tree();
    return std::move(problems_);
  }

  // Keys of blobs whose grid is not there.
  static std::vector<std::uint64_t> strays(Database::Impl& db, Store::Kind kind) {
    std::vector<std::uint64_t> keys = db.store->keys(kind, 0, ~std::uint64_t{0} >> 1);
    std::erase_if(keys, [&](std::uint64_t key) {
      return std::any_of(db.grids.begin(), db.grids.end(),
                         [&](const Grid& g) { return g.info.id == PatchId{key}.grid(); });
    });
    return keys;
  }

 private:
  void say(double share) const {
    if (progress_) progress_(share);
  }
  // Runs `look`, which throws or returns what is wrong; the first few of a kind and place are listed.
  template <class Look>
  bool sound(const std::string& where, Look look) {
    std::string what;
    try {
      what = look();
    } catch (const Error& e) {
      what = e.problem();
    }
    if (!what.empty()) problems_.push_back({what, where});
    return what.empty();
  }
  static std::string place_of(const GridInfo& g, int level, int x, int y) {
    return fmt::format("grid {}, level {}, {}, {}", g.name, level, x, y);
  }

  void check_store() {
    const std::lock_guard lock(db_.store_mutex);
    for (const std::string& damage : db_.store->find_damage()) problems_.push_back({damage, "file"});
    for (const Store::Kind kind : kOfGrids)
      if (const std::size_t n = strays(db_, kind).size())
        problems_.push_back({fmt::format("{} blobs belong to no grid", n), "file"});
  }

  void check_records(const Grid& g) {
    const LazyTable<RecordRun>& runs = g.patches.runs();
    for (std::size_t run = 0; run < runs.size(); ++run)
      records_sound_ &=
          sound(fmt::format("grid {}, records from {} on", g.info.name, run * RecordRun::kRecords),
                [&] { return runs[run].records.empty() ? "it is empty" : ""; });
  }

  // Coarse levels first, and along rows: a chunk's parent is then at hand.
  void check_payloads() {
    struct Row {
      const GridInfo* grid;
      int level, cy;
    };
    std::vector<Row> rows;
    for (const Grid& g : db_.grids)
      for (int l = g.info.shape.levels(); l-- > 0;)
        for (int cy = 0; cy < g.info.shape.chunks_j(l); ++cy) rows.push_back({&g.info, l, cy});
    std::size_t bad = 0;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto [grid, level, cy] = rows[r];
      std::vector<std::string> damage(size_t(grid->shape.chunks_i(level)));
      tbb::parallel_for(size_t(0), damage.size(), [&, grid = grid, level = level, cy = cy](std::size_t cx) {
        try {
          db_.chunk(*grid, level, int(cx), cy);
        } catch (const Error& e) {
          damage[cx] = e.problem();
        }
      });
      for (std::size_t cx = 0; cx < damage.size(); ++cx)
        if (!damage[cx].empty() && ++bad <= kMostOfAKind)
          problems_.push_back({damage[cx], place_of(*grid, level, int(cx), cy)});
      say(kPayloadShare * double(r + 1) / double(rows.size()));
    }
    summarise(bad, "chunks of heights are damaged");
  }

  void check_standings() {
    std::vector<PatchPlace> places;
    for (std::size_t g = 0; g < db_.grids.size(); ++g)
      db_.grids[g].patches.each([&](std::size_t k, const PatchRecord& p) {
        if (p.exists()) places.push_back({g, k});
      });
    std::vector<std::uint8_t> wrong(places.size());
    tbb::enumerable_thread_specific<CoverageCounts> counts;
    constexpr std::size_t kStep = 10000;
    for (std::size_t from = 0; from < places.size(); from += kStep) {
      tbb::parallel_for(from, std::min(places.size(), from + kStep), [&](std::size_t k) {
        const PatchRecord& p = db_.grids[places[k].grid].patches[places[k].index];
        wrong[k] = !(standing(db_.grids, places[k], counts.local()) == Standing{p.top, p.best()});
      });
      say(kPayloadShare + kStandingShare * double(from) / double(places.size()));
    }
    std::size_t bad = 0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const GridInfo& g = db_.grids[places[k].grid].info;
      const GridShape::Block b = g.shape.block(places[k].index);
      if (wrong[k] && ++bad <= kMostOfAKind)
        problems_.push_back(
            {"a patch's top or flag is not what the invariant says", place_of(g, b.level, b.bx, b.by)});
    }
    summarise(bad, "patches have a wrong top or flag");
  }

  void check_tree() {
    sound("R-tree", [&] {
      if (db_.tree_damage) throw Error(*db_.tree_damage);
      const std::string violation = db_.tree.find_violation();
      if (!violation.empty() || !records_sound_) return violation;
      const auto before = [](const LodEntry& a, const LodEntry& b) { return a.id < b.id; };
      std::vector<LodEntry> there, expected = live_entries(db_.grids);
      db_.tree.traverse([](const LodBox&) { return true; }, [&](const LodEntry& e) { there.push_back(e); });
      std::sort(there.begin(), there.end(), before), std::sort(expected.begin(), expected.end(), before);
      if (there != expected) return std::string("its boxes are not those of the patches");
      const std::lock_guard lock(db_.store_mutex);
      const std::size_t stored = db_.store->keys(Store::Kind::tree_page, 1, std::uint64_t{1} << 32).size();
      return stored == db_.tree.shape().nodes || db_.grids.empty()
                 ? ""
                 : std::string("it has pages that hang on no other");
    });
  }

  void summarise(std::size_t bad, const char* what) {
    if (bad > kMostOfAKind) problems_.push_back({fmt::format("{} {} in all", bad, what), "file"});
  }

  Database::Impl& db_;
  const Progress& progress_;
  std::vector<Problem> problems_;
  bool records_sound_ = true;
};

}  // namespace

std::vector<Problem> Database::check(const Progress& progress) const {
  const Reading reading = this->reading();
  return Checker(*impl_, progress).run();
}

RepairReport Database::repair(const Progress& progress) {
  RepairReport report;
  impl_->change([&] {
    for (const Store::Kind kind : kOfGrids)
      for (const std::uint64_t key : Checker::strays(*impl_, kind))
        impl_->store->erase_blobs(kind, key, key + 1), ++report.strays;
    Restate restate(*impl_);
    try {
      report.records = restate.everything();
    } catch (const Error&) {  // records cannot be read: what is left is said below
      report = {};
      return false;
    }
    restate.store("repair");
    return report.done = true;
  });
  report.remaining = check(progress);
  return report;
}

}  // namespace patchwork
