// Damaged files: a clear error or the true answer, never another one; and repairing what can be derived.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>

#include "db/database.h"
#include "tests/db/database_files.h"
#include "tests/db/databases.h"
#include "tests/grids.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

double rough(double x, double y) {
  return 40 * std::sin(x / 170) * std::cos(y / 130) + std::sin(x * 1.7 + y);
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string two_grids(const GridFolder& folder) {
  Database db = folder.database();
  folder.add(db, of_terrain({.width = 130, .height = 110, .accuracy = 1}, rough), "coarse");
  GridFile fine =
      of_terrain({.width = 170, .height = 160, .geotransform = rotated(300, -300, 30, 4, 4)}, rough);
  fine.at = [at = fine.at](int i, int j) { return i > 130 && i < 150 && j > 50 ? kHole : at(i, j); };
  folder.add(db, fine, "fine");
  return db.path();
}

// All that a reader can be told, in one number: structure, tree and heights.
std::string answer(const std::string& path) {
  const Database db = Database::open(path);
  std::string out = db.content_hash();
  std::size_t sum = 0;
  db.tree().traverse([](const LodBox&) { return true; },
                     [&](const LodEntry& e) { sum += e.id.value * 31 + 7; });
  std::size_t heights = 0;
  for (const Grid& g : db.grids())
    each_patch(g, [&](std::size_t k, auto) {
      for (const float c : db.surface(g.patch_id(k))->codes)
        heights = heights * 31 + std::size_t(std::int64_t(c) + 9999);
    });
  return fmt::format("{} {} {}", out, sum, heights);
}

// "" for the true answer, the message of a refusal; a wrong answer fails the test.
std::string outcome(const std::string& path, const std::string& truth) {
  std::string got;
  const std::string refused = refusal_of([&] { got = answer(path); });
  if (refused.empty()) {
    EXPECT_EQ(got, truth) << "a wrong answer";
  }
  return refused;
}

TEST(Damage, AFlippedBitInAnyPageIsRefusedOrChangesNothing) {
  const GridFolder folder;
  const std::string path = two_grids(folder), truth = answer(path), sound = contents(path);
  std::mt19937_64 random(test_seed(1));
  int refused = 0, tried = 0;
  for (std::size_t page = 0; page * 4096 < sound.size(); ++page)
    for (int n = 0; n < 4; ++n, ++tried) {
      std::string bytes = sound;
      const std::size_t at = page * 4096 + (n == 0 ? random() % 100 : random() % 4096);
      bytes[std::min(at, bytes.size() - 1)] ^= char(1 << random() % 8);
      const std::string damaged = folder.path("damaged");
      write(damaged, bytes);
      refused += !outcome(damaged, truth).empty();
    }
  EXPECT_GT(refused, tried / 4);
  EXPECT_LT(refused, tried) << "free space is not read";
}

TEST(Damage, AFileCutAtAnyPageIsRefused) {
  const GridFolder folder;
  const std::string path = two_grids(folder), truth = answer(path), sound = contents(path);
  for (std::size_t length = 0; length < sound.size(); length += 4096)
    for (const std::size_t cut : {length, length + 1000}) {
      const std::string damaged = folder.path("damaged");
      write(damaged, sound.substr(0, cut));
      if (cut >= sound.size()) continue;
      EXPECT_NE(outcome(damaged, truth), "") << cut;
    }
  write(folder.path("whole"), sound);
  EXPECT_EQ(outcome(folder.path("whole"), truth), "") << "the control";
}

TEST(Damage, AStaleOrForeignLogDoesNotChangeTheAnswer) {
  const GridFolder folder;
  const std::string path = two_grids(folder), truth = answer(path), sound = contents(path);
  const std::string damaged = folder.path("damaged");
  for (const std::string& log : {std::string(5000, 'x'), sound.substr(0, 9000), std::string()}) {
    write(damaged, sound);
    write(damaged + "-wal", log);
    EXPECT_EQ(outcome(damaged, truth), "");
    std::filesystem::remove(damaged + "-wal"), std::filesystem::remove(damaged + "-shm");
  }
}

std::string problems(const std::vector<Problem>& list) {
  std::string all;
  for (const Problem& p : list) all += p.where + ": " + p.what + "\n";
  return all;
}

// What check says after `sql`, and whether repair gives the sound database back.
std::string checked(const std::string& sql, bool repairs) {
  const GridFolder folder;
  const std::string path = two_grids(folder), truth = answer(path);
  execute(path, sql);
  const std::string found = problems(Database::open(path).check());
  Database db = Database::open_existing(path);
  const RepairReport r = db.repair();
  EXPECT_EQ(r.remaining.empty(), repairs) << sql << "\n" << problems(r.remaining);
  EXPECT_TRUE(r.done || r.records + r.strays == 0) << "what is told was kept";
  if (repairs) {
    EXPECT_EQ(answer(path), truth) << sql;
  }
  return found;
}

TEST(Check, NamesWhatIsDamagedAndRepairMakesWhatCanBeDerived) {
  EXPECT_EQ(checked("SELECT 1", true), "") << "the control";
  const auto tail = [](const char* table) {
    return fmt::format(
        "UPDATE {} SET data = CAST(substr(data, 1, length(data) - 1) || CASE WHEN substr(data, -1) = x'5A' "
        "THEN x'5B' "
        "ELSE x'5A' END AS BLOB)",
        table);
  };
  const auto says = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text << " lacks " << part;
  };
  says(checked(tail("tree_page"), true), "a page of the R-tree is damaged");
  says(checked("DELETE FROM tree_page", true), "R-tree is missing");
  says(checked("DELETE FROM tree_page WHERE id = 1", true), "a page of the R-tree is missing");
  says(checked("INSERT INTO tree_page SELECT 77, checksum, data FROM tree_page WHERE id = 1", true),
       "hang on no other");
  says(checked("INSERT INTO payload SELECT id + (1 << 52), checksum, data FROM payload LIMIT 1", true),
       "belong to no grid");
  says(checked(tail("payload"), false), "a payload chunk is damaged");
  says(checked("DELETE FROM payload WHERE id = (SELECT max(id) FROM payload)", false), "missing");
  says(checked(tail("records"), false), "a run of patch records is damaged");
  says(checked(tail("records") +
                   "; INSERT INTO payload SELECT id + (1 << 52), checksum, data FROM payload LIMIT 1",
               false),
       "belong to no grid");
}

TEST(Damage, AGridWithDamagedRecordsCanGo) {
  const GridFolder folder;
  const std::string path = two_grids(folder);
  execute(path, "UPDATE records SET checksum = checksum + 1 WHERE id >= (2 << 48)");
  EXPECT_FALSE(Database::open(path).check().empty());
  Database db = Database::open_existing(path);
  db.remove("fine");
  EXPECT_TRUE(db.check().empty()) << problems(db.check());
  Database never = folder.database("never");
  folder.add(never, of_terrain({.width = 130, .height = 110, .accuracy = 1}, rough), "coarse");
  EXPECT_EQ(db.content_hash(), never.content_hash());
}

TEST(Check, FindsAWrongTopAndRepairSetsItRight) {
  const GridFolder folder;
  const std::string path = two_grids(folder), truth = answer(path);
  // The records of the state before the second grid came: sound bytes, wrong tops.
  const GridFolder other;
  Database one = other.database();
  other.add(one, of_terrain({.width = 130, .height = 110, .accuracy = 1}, rough), "coarse");
  const std::string older = one.path();
  { const Database closed = std::move(one); }
  execute(path,
          fmt::format("ATTACH '{}' AS o; INSERT OR REPLACE INTO records SELECT * FROM o.records", older));
  const std::string found = problems(Database::open(path).check());
  EXPECT_NE(found.find("not what the invariant says"), std::string::npos) << found;
  EXPECT_NE(found.find("its boxes are not those of the patches"), std::string::npos) << found;
  Database db = Database::open_existing(path);
  const RepairReport r = db.repair();
  EXPECT_GT(r.records, 0u);
  EXPECT_TRUE(r.remaining.empty());
  EXPECT_EQ(answer(path), truth);
}

}  // namespace
}  // namespace patchwork
