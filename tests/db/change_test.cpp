// Grids come and go: whatever the way, the database is the one that its grids alone make.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <random>
#include <set>

#include "db/database.h"
#include "tests/db/databases.h"
#include "tests/db/model.h"
#include "tests/grids.h"
#include "tests/hard_case.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

// Small surveys at any angle over each other, some with holes, two of equal frame.
std::vector<GridFile> surveys(int n, std::mt19937_64& random) {
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  std::vector<GridFile> files;
  for (int k = 0; k < n; ++k) {
    GridFile file{.width = 20 + int(random() % 50), .height = 20 + int(random() % 40)};
    const double step = uniform(4, 10);
    file.geotransform =
        rotated(uniform(-150, 150), uniform(200, 500), k % 2 ? uniform(-180, 180) : 0, step, step);
    if (k == 3) file = files[2];
    file.accuracy = uniform(0.1, 3);
    file.pixel_is_area = random() % 2;
    const double lift = k;
    file = of_terrain(file, [lift](double x, double y) { return rough_terrain(x, y) + lift; });
    if (k % 3 == 1)
      file.at = [at = file.at, w = file.width](int i, int j) {
        return i < w / 3 && j > 8 ? kHole : at(i, j);
      };
    files.push_back(file);
  }
  return files;
}

// What the model says of a set of grids, evaluated once a set: by name and place of the patch.
struct Expected {
  std::map<std::pair<std::string, std::size_t>, Standing> standings;
  std::string hash;
};

class Trial {
 public:
  Trial(std::uint64_t seed, int grids) : random_(seed), files_(surveys(grids, random_)) {
    for (std::size_t k = 0; k < files_.size(); ++k) sources_.push_back(folder_.source(files_[k], name(k)));
    db_.emplace(folder_.database());
  }

  void step() {
    const std::map<std::pair<std::string, std::size_t>, LodBox> before = live_boxes();
    const std::uint64_t version = db_->version();
    change_one();
    if (db_->version() != version) expect_told_where(before, version);
  }

  void change_one() {
    const auto kind = random_() % 8;
    const std::size_t k = random_() % sources_.size();
    if (kind == 0) {
      db_.reset();
      db_.emplace(random_() % 2 ? Database::open_existing(folder_.path("grids.patchwork"), 1 << 12)
                                : folder_.database());
    } else if (kind == 1 && !in_.empty() && !in_.contains(k)) {
      const std::size_t out = *std::next(in_.begin(), std::ptrdiff_t(random_() % in_.size()));
      db_->import(sources_[k], {.name = name(k), .replace = name(out)});
      in_.erase(out), in_.insert(k);
    } else if (kind < 5) {
      in_.contains(k) ? void(db_->remove(name(k))) : void(db_->import(sources_[k], {.name = name(k)}));
      if (!in_.insert(k).second) in_.erase(k);
    }
  }

  // Every record, the tree and the hash are those of the set; a query finds what a scan does.
  void expect_as_modelled() {
    const Expected& expected = of_set();
    std::size_t patches = 0;
    for (const Grid& g : db_->grids())
      each_patch(g, [&](std::size_t k, auto) {
        ++patches;
        const auto at = expected.standings.find({g.info.name, k});
        ASSERT_NE(at, expected.standings.end());
        EXPECT_EQ(g.patches[k].top, at->second.top) << g.info.name << " " << k;
        EXPECT_EQ(g.patches[k].best(), at->second.best) << g.info.name << " " << k;
      });
    EXPECT_EQ(patches, expected.standings.size());
    EXPECT_EQ(db_->content_hash(), expected.hash);
    EXPECT_EQ(db_->tree().find_violation(), "");
    expect_query();
    watch_redundant();
  }
  /// Patches that were redundant while their grid was in, and later not.
  std::size_t needed_again() const { return needed_again_; }
  const std::set<std::size_t>& in() const { return in_; }
  Database& db() { return *db_; }
  std::size_t sets() const { return known_.size(); }

 private:
  static std::string name(std::size_t k) { return fmt::format("g{}", k); }

  void expect_query() {
    const auto uniform = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random_);
    };
    const double x = uniform(-200, 400), y = uniform(-200, 400), side = uniform(1, 400);
    const Extent region{x, y, x + side, y + side};
    const double error = std::exp(uniform(-3, 4));
    std::set<PatchId> found, scanned;
    db_->tree().visit_uniform(region, error, [&](const LodEntry& e) { found.insert(e.id); });
    for (const Grid& g : db_->grids())
      each_patch(g, [&](std::size_t k, auto) {
        const LodBox b = lod_box(g, k);
        const bool meets = Extent{b.xmin, b.ymin, b.xmax, b.ymax}.meets(region);
        if (!g.patches[k].dormant() && meets && b.bottom <= error && error < b.top)
          scanned.insert(g.patch_id(k));
      });
    EXPECT_EQ(found, scanned);
  }

  std::map<std::pair<std::string, std::size_t>, LodBox> live_boxes() const {
    std::map<std::pair<std::string, std::size_t>, LodBox> all;
    for (const Grid& g : db_->grids())
      each_patch(g, [&](std::size_t k, auto) {
        if (!g.patches[k].dormant()) all[{g.info.name, k}] = lod_box(g, k);
      });
    return all;
  }

  // What came, went or changed among the boxes lies where the change says that it was.
  void expect_told_where(const std::map<std::pair<std::string, std::size_t>, LodBox>& before,
                         std::uint64_t version) {
    const std::vector<Change> changes = db_->changed_since(version);
    ASSERT_EQ(changes.size(), 1u);
    const Extent& told = changes[0].extent;
    const auto now = live_boxes();
    const auto expect_inside = [&](const auto& some, const auto& others) {
      for (const auto& [key, box] : some) {
        const auto other = others.find(key);
        if (other != others.end() && other->second == box) continue;
        EXPECT_TRUE(told.contains({box.xmin, box.ymin}) && told.contains({box.xmax, box.ymax}))
            << changes[0].what << ": " << key.first << " " << key.second;
      }
    };
    expect_inside(before, now), expect_inside(now, before);
  }

  void watch_redundant() {
    std::set<std::pair<std::string, std::size_t>> now;
    for (const Grid& g : db_->grids())
      each_patch(g, [&](std::size_t k, auto) {
        const std::pair place{g.info.name, k};
        const bool was = redundant_.contains(place);
        needed_again_ += was && !g.patches[k].dormant();
        if (g.patches[k].dormant()) now.insert(place);
      });
    redundant_ = std::move(now);
  }

  const Expected& of_set() {
    const auto [at, is_new] = known_.try_emplace(in_);
    if (!is_new) return at->second;
    Expected& e = at->second;
    for (std::size_t g = 0; g < db_->grids().size(); ++g)
      each_patch(db_->grids()[g], [&](std::size_t k, auto) {
        e.standings[{db_->grids()[g].info.name, k}] = {model::top(db_->grids(), {g, k}),
                                                       model::best(db_->grids(), {g, k})};
      });
    // The reference database never saw any other grid.
    const std::string fresh = fmt::format("fresh{}", known_.size());
    Database db = folder_.database(fresh);
    for (const std::size_t k : in_) db.import(sources_[k], {.name = name(k)});
    e.hash = db.content_hash();
    return e;
  }

  GridFolder folder_;
  std::mt19937_64 random_;
  std::vector<GridFile> files_;
  std::vector<RasterSource> sources_;
  std::optional<Database> db_;
  std::set<std::size_t> in_;
  std::set<std::pair<std::string, std::size_t>> redundant_;
  std::size_t needed_again_ = 0;
  std::map<std::set<std::size_t>, Expected> known_;
};

// PATCHWORK_TRIALS=2000 takes as many steps as the design asks for.
TEST(Change, RandomInsertsRemovalsAndReopeningsAgreeWithTheModelAfterEveryStep) {
  Trial trial(test_seed(1), 7);
  std::size_t most = 0;
  for (int n = 0; n < test_trials(400) && !testing::Test::HasFailure(); ++n) {
    trial.step();
    trial.expect_as_modelled();
    most = std::max(most, trial.in().size());
    if (n % 50 == 0) {
      EXPECT_TRUE(trial.db().check().empty());
    }
  }
  EXPECT_GE(most, 4u);
  EXPECT_GT(trial.sets(), 20u);
  report_law("InsertRemove", "random insertions, removals and reopenings", std::uint64_t(test_trials(400)));
  report_control("InsertRemove", "redundant patches dropped for good, that were needed again",
                 std::uint64_t(test_trials(400)), double(trial.needed_again()), 0, "patches");
}

// Two surveys that share a seam hide coarse patches that neither covers alone, on both sides of it.
TEST(Change, TellsOfPatchesThatChangedBesideTheGrid) {
  const GridFolder folder;
  Database db = folder.database();
  const auto survey = [](double west) {
    return of_terrain(
        {.width = 330, .height = 300, .geotransform = {west, 4, 0, 1200, 0, -4}, .accuracy = 0.1},
        rough_terrain);
  };
  folder.add(db,
             of_terrain({.width = 90, .height = 60, .geotransform = {0, 20, 0, 1200, 0, -20}, .accuracy = 2},
                        rough_terrain),
             "base");
  folder.add(db, survey(-200), "west");
  const std::uint64_t before = db.version();
  std::set<std::size_t> live;
  const auto each_live = [&](auto visit) {
    const Grid& base = grid_named(db, "base");
    each_patch(base, [&](std::size_t k, auto) {
      if (!base.patches[k].dormant()) visit(k, lod_box(base, k));
    });
  };
  each_live([&](std::size_t k, const LodBox&) { live.insert(k); });
  const Extent own = folder.add(db, survey(1000), "east").extent,
               told = db.changed_since(before).at(0).extent;
  each_live([&](std::size_t k, const LodBox&) { live.erase(k); });
  int beside = 0;
  for (const std::size_t k : live) {
    const LodBox b = lod_box(grid_named(db, "base"), k);
    EXPECT_TRUE(told.contains({b.xmin, b.ymin}) && told.contains({b.xmax, b.ymax})) << k;
    beside += b.xmin < own.xmin - 40;
  }
  EXPECT_GT(beside, 0) << "negative control: the grid's own bounds would not do";
}

TEST(InsertRemove, GivesBackTheDatabaseThatNeverSawTheGrid) {
  const GridFolder folder;
  std::mt19937_64 random(test_seed(2));
  std::vector<GridFile> files = surveys(5, random);
  files[3] = files[2], files[3].accuracy = 0.01;  // the same survey, better known
  Database db = folder.database(), never = folder.database("never");
  for (std::size_t k = 0; k < 3; ++k) {
    folder.add(db, files[k], fmt::format("g{}", k));
    folder.add(never, files[k], fmt::format("g{}", k));
  }
  const ImportReport first = folder.add(db, files[3], "guest");
  folder.add(db, files[4], "other guest");
  EXPECT_NE(db.content_hash(), never.content_hash()) << "negative control: the guests change it";
  EXPECT_GT(first.lowered, 0u);
  const RemoveReport gone = db.remove("guest");
  EXPECT_EQ(gone.patches, first.patches);
  db.remove("other guest");
  EXPECT_EQ(db.content_hash(), never.content_hash());
  EXPECT_TRUE(db.check().empty());
}

TEST(InsertRemove, DormantPatchesWakeUp) {
  const GridFolder folder;
  Database db = folder.database();
  GridFile file = of_terrain({.width = 120, .height = 100, .accuracy = 4}, rough_terrain);
  folder.add(db, file, "old");
  const std::size_t live = count_live(db);
  file.accuracy = 0.5;
  const ImportReport better = folder.add(db, file, "new");
  EXPECT_EQ(better.hidden, live);
  const RemoveReport gone = db.remove("new");
  EXPECT_EQ(gone.woken, live);
  EXPECT_EQ(count_live(db), live);
}

TEST(InsertRemove, TheLastGridLeavesAnEmptySoundDatabase) {
  const GridFolder folder;
  Database db = folder.database();
  const std::string empty = db.content_hash();
  folder.add(db, heights("1 2 / 3 4"), "only");
  db.remove("only");
  EXPECT_EQ(db.content_hash(), empty);
  EXPECT_TRUE(db.grids().empty());
  EXPECT_EQ(db.tree().size(), 0u);
  EXPECT_TRUE(Database::open(db.path()).check().empty());
}

TEST(InsertRemove, ANameThatIsNotThereIsRefused) {
  const GridFolder folder;
  Database db = folder.database();
  folder.add(db, heights("1 2 / 3 4"), "only");
  EXPECT_NE(refusal_of([&] { db.remove("other"); }).find("no grid named other"), std::string::npos);
  EXPECT_NE(refusal_of([&] {
              folder.add(db, heights("1 2 / 3 5"), "x", {.replace = "other"});
            }).find("no grid named other"),
            std::string::npos);
  EXPECT_EQ(db.grids().size(), 1u);
}

TEST(Replace, IsRemovalAndImportInOneChange) {
  const GridFolder folder;
  std::mt19937_64 random(test_seed(3));
  const std::vector<GridFile> files = surveys(3, random);
  Database db = folder.database(), other = folder.database("other");
  folder.add(db, files[0], "base"), folder.add(other, files[0], "base");
  const Extent gone = folder.add(db, files[1], "survey").extent;
  const std::uint64_t before = db.version();
  const ImportReport r = folder.add(db, files[2], "survey", {.replace = "survey"});
  folder.add(other, files[2], "survey");
  EXPECT_EQ(db.version(), before + 1) << "no reader sees it without the survey";
  EXPECT_GT(r.removed, 0u);
  const Extent told = db.changed_since(before).at(0).extent;
  EXPECT_TRUE(told.contains({gone.xmin, gone.ymin}) && told.contains({gone.xmax, gone.ymax}));
  EXPECT_EQ(db.content_hash(), other.content_hash());
  EXPECT_TRUE(db.check().empty());
  // The next grid may get the number of the one that left; its heights must be its own.
  EXPECT_EQ(different_surfaces(db, grid_named(db, "survey"), other, grid_named(other, "survey")), 0);
}

TEST(ReadSamples, GivesBackTheFilesSamplesToTheLastBit) {
  for (const GDALDataType type : {GDT_Int16, GDT_Float32}) {
    const GridFolder folder;
    Database db = folder.database();
    GridFile file = of_terrain({.width = 150, .height = 131, .type = type}, rough_terrain);
    file.at = [at = file.at, type](int i, int j) {
      if ((i > 30 && i < 60 && j > 40) || (i % 7 == 0 && j % 5 == 0)) return kHole;
      return type == GDT_Int16 ? std::round(at(i, j))
                               : double(float(std::ldexp(std::round(at(i, j) * 256), -8)));
    };
    if (type == GDT_Int16) file.nodata = -999;
    // A sample alone in a hole: it is in no cell with data.
    file.at = [at = file.at](int i, int j) { return i == 45 && j == 80 ? 7.0 : at(i, j); };
    folder.add(db, file, "grid");
    // Rows one by one, and bands that begin in one row of chunks and end in the next.
    for (const int rows : {1, 30, 131}) {
      std::vector<double> band(150 * size_t(rows));
      int wrong = 0, holes = 0;
      for (int first = 0; first < file.height; first += rows) {
        const int n = std::min(rows, file.height - first);
        db.read_samples(db.grids()[0].info.id, first, n, band);
        for (int j = 0; j < n; ++j)
          for (int i = 0; i < file.width; ++i) {
            const double h = file.at(i, first + j), got = band[size_t(j) * 150 + size_t(i)];
            holes += std::isnan(h), wrong += !(got == h || (std::isnan(got) && std::isnan(h)));
          }
      }
      EXPECT_EQ(wrong, 0) << rows << " at a time";
      EXPECT_GT(holes, 1000);
    }
  }
}

TEST(Tolerance, EntersTheBoundAndIsKept) {
  const GridFolder folder;
  Database db = folder.database(), exact = folder.database("exact");
  const GridFile file = of_terrain({.width = 150, .height = 131, .accuracy = 0.2}, rough_terrain);
  const ImportReport r = folder.add(db, file, "grid", {.tolerance = 0.3});
  folder.add(exact, file, "grid");
  EXPECT_EQ(r.quantisation, 0.3);
  EXPECT_EQ(grid_named(db, "grid").at(0, 0, 0).error[0], 0.5);
  EXPECT_LT(db.file_bytes(), exact.file_bytes());
  std::vector<double> row(150);
  double most = 0;
  for (int j = 0; j < file.height; ++j) {
    db.read_samples(db.grids()[0].info.id, j, 1, row);
    for (int i = 0; i < file.width; ++i)
      most = std::max(most, std::abs(row[size_t(i)] - double(float(file.at(i, j)))));
  }
  EXPECT_LE(most, 0.3);
  EXPECT_GT(most, 0.25);
}

}  // namespace
}  // namespace patchwork
