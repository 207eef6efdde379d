// A database as one thing: what it was after a failure, and refused where it is damaged.
#include "db/database.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "db/codec.h"
#include "tests/db/database_files.h"
#include "tests/db/databases.h"
#include "tests/grids.h"

namespace patchwork {
namespace {

bool says(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
  return true;
}

// --- What is stored.

Database two_grids(const GridFolder& folder) {
  Database db = folder.database();
  folder.add(db, of_terrain({.width = 150, .height = 130, .accuracy = 1}, rough_terrain), "coarse");
  GridFile fine =
      of_terrain({.width = 90, .height = 80, .geotransform = rotated(300, -300, 30, 4, 4)}, rough_terrain);
  fine.at = [at = fine.at](int i, int j) { return i > 30 && i < 50 && j > 60 ? kHole : at(i, j); };
  folder.add(db, fine, "fine");
  return db;
}

TEST(Database, ReopenedItIsWhatItWas) {
  const GridFolder folder;
  const Database written = two_grids(folder);
  const Database read = Database::open(written.path());
  EXPECT_EQ(read.content_hash(), written.content_hash());
  EXPECT_EQ(read.crs(), written.crs());
  EXPECT_EQ(read.sample_bytes(), written.sample_bytes());
  EXPECT_EQ(read.coverage_counts().integer, written.coverage_counts().integer);
  ASSERT_EQ(read.grids().size(), written.grids().size());
  for (std::size_t g = 0; g < read.grids().size(); ++g) {
    const Grid &a = read.grids()[g], &b = written.grids()[g];
    EXPECT_EQ(a.info.name, b.info.name);
    EXPECT_EQ(a.info.frame.numbers(), b.info.frame.numbers());
    EXPECT_EQ(a.info.rim_error, b.info.rim_error);
    EXPECT_TRUE(a.patches == b.patches);
    EXPECT_EQ(different_surfaces(read, a, written, b), 0);
  }
  EXPECT_EQ(read.tree().find_violation(), "");
  EXPECT_EQ(read.tree().header_bytes(), written.tree().header_bytes());
}

TEST(Database, TheHashDoesNotDependOnNames) {
  const GridFolder folder;
  Database a = folder.database("a"), b = folder.database("b");
  folder.add(a, heights("1 2 / 3 4"), "one");
  folder.add(b, heights("1 2 / 3 4"), "two");
  EXPECT_EQ(a.content_hash(), b.content_hash());
}

TEST(Database, AReaderKeepsItsStateWhileAnotherWrites) {
  const GridFolder folder;
  Database writer = two_grids(folder);
  const Database reader = Database::open(writer.path());
  const std::string before = writer.content_hash();
  folder.add(writer, heights("1 2 / 3 4", {.accuracy = 0.01}), "later");
  EXPECT_EQ(reader.content_hash(), before);
  EXPECT_NO_THROW(reader.surface(reader.grids()[0].patch_id(0)));
  EXPECT_NE(Database::open(writer.path()).content_hash(), before);
}

TEST(Database, IsNewestUntilAnotherCommits) {
  const GridFolder folder;
  Database writer = two_grids(folder);
  Database reader = Database::open(writer.path());
  EXPECT_TRUE(reader.is_newest());
  folder.add(writer, heights("1 2 / 3 4", {.accuracy = 0.01}), "later");
  const std::string old = reader.content_hash();
  EXPECT_FALSE(reader.is_newest());
  EXPECT_EQ(reader.content_hash(), old) << "asking moves nothing";
  EXPECT_TRUE(reader.refresh());
  EXPECT_TRUE(reader.is_newest());
  EXPECT_TRUE(writer.is_newest());
}

TEST(Database, HeightsStayInMemoryWhereTheirGridDoes) {
  const GridFolder folder;
  Database writer = two_grids(folder);
  folder.add(writer, heights("1 2 / 3 4", {.accuracy = 0.01}), "later");
  Database reader = Database::open(writer.path());
  const PatchId stays = grid_named(reader, "later").patch_id(0),
                goes = grid_named(reader, "fine").patch_id(0);
  const auto kept = reader.surface(stays), gone = reader.surface(goes);
  writer.remove("fine");
  const ImportReport another = folder.add(writer, heights("5 6 / 7 8", {.accuracy = 0.02}), "another");
  ASSERT_TRUE(reader.refresh());
  EXPECT_EQ(reader.surface(stays), kept) << "not read again";
  const PatchId same_name = grid_named(reader, "another").patch_id(0);
  EXPECT_NE(reader.surface(same_name), gone) << "even if it has the id of the grid that went";
}

TEST(Database, RefreshMovesToTheNewestStateAndSaysWhatChanged) {
  const GridFolder folder;
  Database writer = two_grids(folder);
  Database reader = Database::open(writer.path());
  const std::uint64_t before = reader.version();
  EXPECT_FALSE(reader.refresh());
  const ImportReport added = folder.add(writer, heights("1 2 / 3 4", {.accuracy = 0.01}), "later");
  writer.remove("fine");
  EXPECT_TRUE(reader.changed_since(before).empty()) << "the state that is seen is the old one";
  EXPECT_TRUE(reader.refresh());
  EXPECT_EQ(reader.version(), before + 2);
  EXPECT_EQ(reader.content_hash(), writer.content_hash());
  const std::vector<Change> changes = reader.changed_since(before);
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[0].what, "import later");
  EXPECT_EQ(changes[0].extent.xmax, added.extent.xmax);
  EXPECT_EQ(changes[1].what, "remove fine");
  EXPECT_EQ(reader.changed_since(before + 1).size(), 1u);
}

TEST(Database, AReaderLetsGoOfStructureThatNobodyReads) {
  const GridFolder folder;
  Database written = folder.database();
  folder.add(written, of_terrain({.width = 800, .height = 700}, rough_terrain), "large");
  const std::string path = written.path();
  const Database roomy = Database::open(path), tight = Database::open(path, 1 << 10);
  for (const Database* db : {&roomy, &tight}) {
    const Database::Reading reading = db->reading();
    db->tree().traverse([](const LodBox&) { return true; }, [](const LodEntry&) {});
    db->patch(db->grids()[0].patch_id(0));
    EXPECT_GT(db->tree().loaded_pages(), 1u) << "what is being read stays";
  }
  tight.reading(), roomy.reading();
  EXPECT_EQ(tight.tree().loaded_pages(), 0u);
  EXPECT_GT(roomy.tree().loaded_pages(), 1u) << "negative control: there is room";
  EXPECT_EQ(tight.content_hash(), roomy.content_hash());
}

// Runs `act`, which must be refused, and expects the database to be as before, in memory and byte by byte.
void expect_unharmed(const std::function<std::string(const GridFolder&, Database&)>& act) {
  const GridFolder folder;
  std::string path, hash;
  {
    const Database db = two_grids(folder);
    path = db.path(), hash = db.content_hash();
  }
  const std::string bytes = contents(path);
  {
    Database db = folder.database();
    EXPECT_EQ(act(folder, db), "");
    EXPECT_EQ(db.content_hash(), hash);
    EXPECT_EQ(db.tree().find_violation(), "");
    EXPECT_EQ(db.tree().size(), count_live(db));
    EXPECT_EQ(Database::open(path).content_hash(), hash);
  }
  EXPECT_EQ(contents(path) == bytes, true) << "the file changed";
}

TEST(Database, AFailedImportLeavesItAsItWas) {
  const auto refused = [](const GridFile& file, const char* why) {
    return [file, why](const GridFolder& folder, Database& db) {
      const std::string what = refusal_of([&] { folder.add(db, file, "bad"); });
      return what.find(why) == std::string::npos ? "not refused as expected: " + what : "";
    };
  };
  GridFile nothing{.width = 60, .height = 50, .at = [](int, int) { return kHole; }};
  expect_unharmed(refused(nothing, "every sample is nodata"));
  GridFile board{.width = 300, .height = 250};
  board.at = [](int i, int j) { return (i + j) % 2 ? kHole : 1.0; };
  expect_unharmed(refused(board, "no cell with data at all four corners"));
}

TEST(Database, AnImportBrokenOffHalfwayLeavesItAsItWas) {
  for (const double at : {0.0, 0.3, 0.85}) {
    expect_unharmed([at](const GridFolder& folder, Database& db) {
      struct Stop {};
      ImportOptions options{.progress = [at](double share) {
        if (share >= at) throw Stop{};
      }};
      try {
        folder.add(db, of_terrain({.width = 200, .height = 200}, rough_terrain), "stopped", options);
      } catch (const Stop&) {
        return "";
      }
      return "it was not stopped";
    });
  }
}

TEST(Database, ADryRunReportsAndKeepsNothing) {
  expect_unharmed([](const GridFolder& folder, Database& db) {
    const GridFile file = of_terrain({.width = 200, .height = 200, .accuracy = 0.01}, rough_terrain);
    const ImportReport dry = folder.add(db, file, "dry", {.dry_run = true});
    EXPECT_GT(dry.patches, 0u);
    EXPECT_EQ(db.grids().size(), 2u);
    const GridFolder other;
    Database copy = two_grids(other);
    const ImportReport wet = folder.add(copy, file, "wet");
    EXPECT_EQ(dry.patches, wet.patches);
    EXPECT_EQ(dry.hidden, wet.hidden);
    EXPECT_EQ(dry.lowered, wet.lowered);
    return "";
  });
}

// --- Files that are none, or damaged.

TEST(Database, WhatIsNoDatabaseIsRefusedByName) {
  const GridFolder folder;
  const auto refused = [&](const std::string& name, const char* why) {
    const std::string path = folder.path(name);
    for (const std::string& what : {refusal_of([&] { Database::open(path); }),
                                    refusal_of([&] { Database::open_or_create(path, ""); })}) {
      EXPECT_TRUE(says(what, path));
      EXPECT_TRUE(says(what, why));
    }
  };
  EXPECT_TRUE(says(refusal_of([&] { Database::open(folder.path("absent")); }), "there is no such database"));
  EXPECT_FALSE(std::filesystem::exists(folder.path("absent")));
  std::ofstream(folder.path("text")) << std::string(5000, 'x');
  refused("text", "it is not a database");
  execute(folder.path("foreign"), "CREATE TABLE t(x); PRAGMA application_id = 5");
  refused("foreign", "another program");
  execute(folder.path("anonymous"), "CREATE TABLE t(x)");
  refused("anonymous", "another program");
  folder.database("newer");
  execute(folder.path("newer"), "PRAGMA user_version = 99");
  refused("newer", "newer Patchwork (schema 99)");
  std::filesystem::create_directory(folder.path("folder"));
  refused("folder", "it is a folder");
  EXPECT_TRUE(
      says(refusal_of([&] { Database::open_or_create(folder.path("no/such/folder/db"), ""); }), "no/such"));
}

// The database with `sql` done to it; what opening it and reading every patch is refused with.
std::string damaged(const std::string& sql) {
  const GridFolder folder;
  std::string path;
  { path = two_grids(folder).path(); }
  execute(path, sql);
  const std::string what = refusal_of([&] {
    const Database db = Database::open(path);
    for (const Grid& g : db.grids()) each_patch(g, [&](std::size_t k, auto) { db.surface(g.patch_id(k)); });
    db.tree().traverse([](const LodBox&) { return true; }, [](const LodEntry&) {});
  });
  if (!what.empty()) {
    EXPECT_EQ(what.find(path), 0u) << what << " does not begin with the file's name";
  }
  return what;
}

TEST(Database, DamageIsReportedWithTheNameOfTheFile) {
  EXPECT_EQ(damaged("SELECT 1"), "") << "negative control: the sound database is read";
  // The last byte replaced by another one.
  const auto tail = [&](const char* table, const char* column) {
    return fmt::format(
        "UPDATE {0} SET {1} = CAST(substr({1}, 1, length({1}) - 1) || "
        "CASE WHEN substr({1}, -1) = x'5A' THEN x'5B' ELSE x'5A' END AS BLOB)",
        table, column);
  };
  EXPECT_TRUE(says(damaged(tail("payload", "data")), "a payload chunk is damaged"));
  EXPECT_TRUE(says(damaged(tail("records", "data")), "a run of patch records is damaged"));
  EXPECT_TRUE(says(damaged(tail("tree_page", "data")), "a page of the R-tree is damaged"));
  EXPECT_TRUE(says(damaged(tail("grid", "facts")), "the record of grid coarse is damaged"));
  EXPECT_TRUE(says(damaged("DELETE FROM payload WHERE rowid = (SELECT max(id) FROM payload)"), "missing"));
  EXPECT_TRUE(says(damaged("DELETE FROM records"), "missing"));
  EXPECT_NE(damaged("DROP TABLE payload"), "");
}

// --- Records that someone made up, and files of earlier versions.

void put_facts(const std::string& path, const std::vector<std::uint8_t>& cbor) {
  std::string hex;
  for (const std::uint8_t byte : cbor) hex += fmt::format("{:02x}", byte);
  execute(path, fmt::format("UPDATE grid SET facts = x'{}', checksum = {}", hex,
                            std::int64_t(checksum(std::as_bytes(std::span(cbor))))));
}

// Gives the record of the only grid other facts, with the checksum that they should have.
void change_facts(const std::string& path, const std::function<void(nlohmann::json&)>& change) {
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &raw), SQLITE_OK);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> closed(raw, sqlite3_close);
  sqlite3_stmt* facts = nullptr;
  ASSERT_EQ(sqlite3_prepare_v2(raw, "SELECT facts FROM grid", -1, &facts, nullptr), SQLITE_OK);
  ASSERT_EQ(sqlite3_step(facts), SQLITE_ROW);
  const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(facts, 0));
  nlohmann::json record = nlohmann::json::from_cbor(bytes, bytes + sqlite3_column_bytes(facts, 0));
  sqlite3_finalize(facts);
  change(record);
  put_facts(path, nlohmann::json::to_cbor(record));
}

TEST(Database, ARecordThatCannotBeIsRefusedThoughItsChecksumHolds) {
  const auto refused = [](const std::function<void(const std::string&)>& spoil) {
    const GridFolder folder;
    const std::string path = folder.path("grids.patchwork");
    {
      Database db = folder.database();
      folder.add(db, heights("1 2 / 3 4"), "only");
    }
    spoil(path);
    return refusal_of([&] { Database::open(path); });
  };
  EXPECT_EQ(refused([](const std::string& path) { change_facts(path, [](nlohmann::json&) {}); }), "")
      << "negative control";
  EXPECT_TRUE(says(refused([](const std::string& path) {
                     change_facts(path, [](nlohmann::json& f) { f["width"] = f["height"] = 1400000; });
                   }),
                   "an impossible size"));
  EXPECT_TRUE(says(refused([](const std::string& path) {
                     change_facts(path, [](nlohmann::json& f) { f["frame"] = {0, 1, 0.01, 0, 0, -1}; });
                   }),
                   "an impossible frame"));
  EXPECT_TRUE(says(refused([](const std::string& path) {
                     put_facts(path, std::vector<std::uint8_t>(1000000, 0x81));  // lists in lists
                   }),
                   "too long"));
  EXPECT_TRUE(says(refused([](const std::string& path) { execute(path, "UPDATE grid SET id = 65537"); }),
                   "an impossible id"));
  EXPECT_TRUE(says(refused([](const std::string& path) {
                     execute(path, "UPDATE fact SET value = '1x' WHERE key = 'version'");
                   }),
                   "fact version is damaged"));
}

// What was read before is no state of the file any more; and the next grid gets the number of the one that
// left, but not its heights.
TEST(Database, ARefreshThatFailedCanBeAskedAgain) {
  const GridFolder folder;
  Database writer = folder.database();
  folder.add(writer, heights("1 2 / 3 4"), "one");
  Database reader = Database::open(writer.path());
  reader.surface(PatchId::make(reader.grids()[0].info.id, 0, 0, 0));
  writer.remove("one"), folder.add(writer, heights("5 6 / 7 8"), "two");
  ASSERT_EQ(writer.grids()[0].info.id, reader.grids()[0].info.id);
  execute(writer.path(), "UPDATE grid SET checksum = checksum + 1");
  for (int k = 0; k < 2; ++k) {
    EXPECT_NE(refusal_of([&] { reader.refresh(); }), "");
    EXPECT_TRUE(reader.grids().empty());
    EXPECT_NE(refusal_of([&] { reader.tree(); }), "");
  }
  execute(writer.path(), "UPDATE grid SET checksum = checksum - 1");
  EXPECT_TRUE(reader.refresh());
  EXPECT_EQ(reader.content_hash(), writer.content_hash());
  EXPECT_EQ(different_surfaces(reader, reader.grids()[0], writer, writer.grids()[0]), 0);
}

// Files of earlier versions do not say how far a surface stands beyond its samples; what is assumed must hold
// it, which of a flat lake is what storing it lost.
TEST(Database, AFileThatDoesNotSayHowFarItsSurfaceStandsBeyondIsGivenEnough) {
  for (const double waves : {0.01, 30.0}) {
    const GridFolder folder;
    Database written = folder.database();
    const auto lake = [&](int i, int j) { return (i + j) % 2 ? waves : -waves; };
    folder.add(written, {.at = lake}, "lake", {.tolerance = 0.5});
    const GridInfo said = written.grids()[0].info;
    ASSERT_GE(said.overshoot, said.quantisation);
    change_facts(written.path(), [](nlohmann::json& facts) { EXPECT_EQ(facts.erase("overshoot"), 1u); });
    const Database earlier = Database::open(written.path());
    const GridInfo assumed = earlier.grids()[0].info;
    EXPECT_GE(assumed.overshoot, said.overshoot);
    EXPECT_LE(assumed.overshoot, 3.1 * (2 * waves + 4 * said.quantisation));
  }
}

// --- Files that come and go, and CRSs.

TEST(Database, AFileIsTakenAwayOnlyWithoutGrids) {
  const GridFolder folder;
  {
    Database empty = folder.database("empty"), full = folder.database("full");
    EXPECT_TRUE(empty.made_file());
    Database other = folder.database("full");
    EXPECT_FALSE(other.made_file());
    folder.add(other, of_terrain({.width = 40, .height = 40}, rough_terrain), "grid");
    empty.remove_if_empty(), full.remove_if_empty();
  }
  for (const char* end : {"", "-wal", "-shm"})
    EXPECT_FALSE(std::filesystem::exists(folder.path("empty") + end)) << end;
  EXPECT_EQ(Database::open(folder.path("full")).grids().size(), 1u);
}

TEST(Database, WhoWritesToAFileThatIsGoneHearsOfIt) {
  const GridFolder folder;
  Database db = folder.database();
  const GridFile file = of_terrain({.width = 40, .height = 40}, rough_terrain);
  folder.add(db, file, "before");
  std::filesystem::remove(db.path());
  EXPECT_TRUE(says(refusal_of([&] { folder.add(db, file, "after"); }), "it was removed"));
}

TEST(Database, TheFirstGridBringsTheCrsAndOneOfAnotherIsRefused) {
  const GridFolder folder;
  Database db = folder.database();
  const std::string path = folder.write(of_terrain({.width = 40, .height = 40}, rough_terrain), "grid");
  const auto add = [&](const char* crs, const std::string& of_database, ImportOptions options) {
    db.import(RasterSource::open(path, {.crs = crs}, of_database), options);
  };
  add("EPSG:32632", "", {.name = "dry", .dry_run = true});
  EXPECT_EQ(db.crs(), "") << "nothing is kept";
  add("EPSG:32632", "", {.name = "first"});
  EXPECT_TRUE(same_crs(db.crs(), "EPSG:32632"));
  EXPECT_FALSE(same_crs(db.crs(), "EPSG:32633"));
  EXPECT_TRUE(says(refusal_of([&] { add("EPSG:32633", "", {.name = "other"}); }), "another CRS"));
  EXPECT_EQ(refusal_of([&] { add("EPSG:32633", db.crs(), {.name = "other"}); }), "") << "warped, it may come";
  EXPECT_TRUE(same_crs(Database::open(db.path()).crs(), "EPSG:32632"));
}

TEST(Database, IdsThatAreFreeAreGivenAgainOnceAllWereGiven) {
  const GridFolder folder;
  const auto store = open_store(folder.path("ids"), StoreMode::create);
  store->begin_write();
  const auto add = [&](std::uint32_t n) {
    GridInfo g;
    g.name = std::to_string(n), g.shape = GridShape(2, 2, false);
    std::memcpy(g.digest.data(), &n, sizeof n);
    return store->add_grid(g).value;
  };
  for (std::uint32_t n = 1; n <= GridId::kMost; ++n) ASSERT_EQ(add(n), n);
  EXPECT_TRUE(says(refusal_of([&] { add(0); }), "as many grids as it can"));
  for (const std::uint32_t n : {1u, 77u, GridId::kMost}) {
    store->remove_grid({n});
    EXPECT_EQ(add(n), n);
  }
}

}  // namespace
}  // namespace patchwork
