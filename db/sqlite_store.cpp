// The SQLite form of the store: one file in WAL mode, one table a kind of thing (schema below).
#include "db/store.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "db/codec.h"
#include "db/error.h"
#include "db/pack.h"
#include "db/sqlite_statement_impl.h"

namespace patchwork {

namespace {

constexpr int kApplicationId = 0x50776b31;  // "Pwk1", frozen
constexpr int kSchemaVersion = 2;
constexpr int kBusyMilliseconds = 10000, kRetryMilliseconds = 5;
constexpr std::uintmax_t kPageBytes = 4096;
constexpr std::size_t kMostPacked = 1 << 24;  // bytes of a records or tree blob, unpacked
constexpr std::size_t kMostFacts = 4096;      // bytes of a grid's facts, which take some 400

constexpr const char* kSchema = R"(
  CREATE TABLE fact(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE grid(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, digest BLOB NOT NULL UNIQUE, facts BLOB NOT NULL,
                    checksum INTEGER NOT NULL);
  CREATE TABLE records(id INTEGER PRIMARY KEY, checksum INTEGER NOT NULL, data BLOB NOT NULL);
  CREATE TABLE tree_page(id INTEGER PRIMARY KEY, checksum INTEGER NOT NULL, data BLOB NOT NULL);
  CREATE TABLE payload(id INTEGER PRIMARY KEY, checksum INTEGER NOT NULL, data BLOB NOT NULL);
  CREATE TABLE change(version INTEGER PRIMARY KEY, what TEXT NOT NULL, xmin REAL NOT NULL, ymin REAL NOT NULL,
                      xmax REAL NOT NULL, ymax REAL NOT NULL);
)";

// A kind of blob: its table, what a person calls one, and whether its bytes are packed.
struct Shelf {
  std::string table, what;
  bool packed;
};
const std::array<Shelf, 3> kShelves{{{"records", "a run of patch records", true},
                                     {"tree_page", "a page of the R-tree", true},
                                     {"payload", "a payload chunk", false}}};

// In a folder that is read-only, or on a full disk, SQLite cannot make the -shm file that a reader needs;
// where no log lies beside the file, it alone is the whole state. CAVEAT: a writer with more rights than ours
// is then not seen.
bool in_frozen_folder(const std::string& path) {
  return access(std::filesystem::absolute(path).parent_path().c_str(), W_OK) != 0;
}
bool is_whole(const std::string& path) {
  std::error_code absent;
  const auto log = std::filesystem::file_size(path + "-wal", absent);
  return absent || log == 0;
}

std::string frozen_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) uri += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
  return uri + "?immutable=1";
}

nlohmann::json facts_of(const GridInfo& g) {
  return {{"frame", g.frame.numbers()},
          {"width", g.shape.width()},
          {"height", g.shape.height()},
          {"area", g.shape.pixel_is_area()},
          {"accuracy", g.accuracy},
          {"quantum", g.quantum},
          {"base", g.base},
          {"code_origin", g.code_origin},
          {"quantisation", g.quantisation},
          {"rim_error", g.rim_error},
          {"lowest", g.lowest},
          {"highest", g.highest},
          {"overshoot", g.overshoot},
          {"holes", g.holes},
          {"sample_type", g.sample_type},
          {"sample_bytes", g.sample_bytes},
          {"raw_scale", g.raw_scale},
          {"nodata", g.nodata ? nlohmann::json(*g.nodata) : nlohmann::json()}};
}

// Throws nlohmann's exceptions for facts that are none.
GridInfo info_from(const nlohmann::json& f) {
  GridInfo g;
  const int width = f.at("width"), height = f.at("height");
  if (std::min(width, height) < 2 || std::max(width, height) > GridShape::kMostSamples)
    throw std::invalid_argument("an impossible size");
  g.shape = GridShape(width, height, f.at("area"));
  if (g.shape.blocks() > GridShape::kMostBlocks) throw std::invalid_argument("an impossible size");
  const auto frame = f.at("frame").get<std::array<double, 6>>();
  for (const double n : frame)
    if (!std::isfinite(n)) throw std::invalid_argument("an impossible frame");
  g.frame = Frame::from_trusted(frame);
  if (!std::isfinite(g.frame.cell_area()) || !(g.frame.cell_area() > 0) ||
      !(std::abs(g.frame.cosine()) <= Frame::kMostShear))
    throw std::invalid_argument("an impossible frame");
  g.accuracy = f.at("accuracy"), g.quantum = f.at("quantum"), g.base = f.at("base");
  g.code_origin = f.at("code_origin"), g.quantisation = f.at("quantisation"), g.rim_error = f.at("rim_error");
  g.holes = f.at("holes"), g.sample_type = f.at("sample_type"), g.sample_bytes = f.at("sample_bytes");
  g.raw_scale = f.at("raw_scale"), g.lowest = f.at("lowest"), g.highest = f.at("highest");
  // Files of earlier versions do not say it. In ranges of the samples, as they are stored: one and a half
  // beyond the rim, and what a smooth interpolant, whose weights sum up to 1.25^2, departs at most.
  constexpr double kMostOvershoot = 3;
  const double q = g.quantisation, most = kMostOvershoot * (g.highest - g.lowest + 2 * q) + q;
  g.overshoot = f.value("overshoot", most);
  if (!f.at("nodata").is_null()) g.nodata = f.at("nodata").get<double>();
  return g;
}

class SqliteStore : public Store {
 public:
  SqliteStore(const std::string& path, StoreMode mode);
  const std::string& path() const override { return path_; }

  void begin_read() override {
    exec("BEGIN");
    pragma("SELECT count(*) FROM fact");  // the snapshot is taken by the first read
  }
  void begin_write() override {
    exec("BEGIN IMMEDIATE");
    int moved = 0;  // a file that is nowhere keeps nothing
    if (sqlite3_file_control(db_, "main", SQLITE_FCNTL_HAS_MOVED, &moved) == SQLITE_OK && moved) {
      rollback();
      throw Error(path_, "it was removed, or another file took its place", "run the command again");
    }
  }
  void commit() override { exec("COMMIT"); }
  void rollback() noexcept override {
    for (Statements& s : statements_)
      for (Statement* one : {s.get.get(), s.put.get()})
        if (one) one->reset();
    if (!sqlite3_get_autocommit(db_)) sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);
  }

  std::optional<std::string> fact(const std::string& key) override;
  void set_fact(const std::string& key, const std::string& value) override;
  std::vector<GridInfo> grids() override;
  GridId add_grid(const GridInfo& info) override;
  void update_grid(const GridInfo& info) override;
  void remove_grid(GridId id) override;
  std::optional<Bytes> blob(Kind kind, std::uint64_t key) override;
  void put_blob(Kind kind, std::uint64_t key, std::span<const std::byte> bytes) override;
  void erase_blobs(Kind kind, std::uint64_t first, std::uint64_t end) override;
  std::vector<std::uint64_t> keys(Kind kind, std::uint64_t first, std::uint64_t end) override;
  void note_change(const Change& change) override;
  std::vector<Change> changes_after(std::uint64_t version) override;
  std::vector<std::string> find_damage() override;
  std::uint64_t file_bytes() const override;
  bool made_file() const override { return made_; }
  void remove_file() override {
    // The file goes last: who finds one finds no log of another.
    for (const char* end : {"-wal", "-shm", ""}) std::filesystem::remove(path_ + end);
  }

 private:
  // Of one kind of blobs, made when first needed.
  struct Statements {
    std::unique_ptr<Statement> get, put;
  };
  static const Shelf& shelf(Kind kind) { return kShelves[size_t(kind)]; }

  void exec(const char* sql) {
    if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) != SQLITE_OK)
      throw Error(path_, sqlite3_errmsg(db_), advice_for(sqlite3_extended_errcode(db_)));
  }
  std::int64_t pragma(const char* sql) {
    Statement s(db_, path_, sql);
    return s.step() ? s.integer(0) : 0;
  }
  Bytes checked(Bytes bytes, std::int64_t sum, const std::string& what) {
    if (checksum(bytes) != std::uint64_t(sum))
      throw Error(path_, what + " is damaged (its checksum differs)", advice_for(SQLITE_CORRUPT));
    return bytes;
  }
  void connect(StoreMode mode, bool frozen);
  void put_grid(const GridInfo& info, const char* sql);
  bool blank() {
    return pragma("PRAGMA application_id") == 0 && pragma("PRAGMA user_version") == 0 &&
           pragma("SELECT count(*) FROM sqlite_schema") == 0;
  }
  // The change to a write-ahead log does not wait for another process that makes it, as all else does.
  void write_ahead() {
    const std::string sql =
        "PRAGMA page_size = " + std::to_string(kPageBytes) + "; PRAGMA journal_mode = WAL";
    for (int ms = 0; ms < kBusyMilliseconds; ms += kRetryMilliseconds) {
      if ((sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) & 0xff) != SQLITE_BUSY) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(kRetryMilliseconds));
    }
    exec(sql.c_str());
  }
  // On a full disk it may not even be readable.
  bool holds_nothing() {
    try {
      return blank();
    } catch (const Error&) {
      std::error_code absent;
      const std::uintmax_t log = std::filesystem::file_size(path_ + "-wal", absent);
      const bool no_log = absent || log == 0;
      return no_log && std::filesystem::file_size(path_, absent) <= kPageBytes;
    }
  }
  void prepare_file(bool may_create) {
    if (may_create && blank()) {  // pages of 4 KiB: with 8 KiB Puget Sound (1025^2, 16 bit) took 6 % more,
                                  // above its raw samples
      write_ahead();
      begin_write();
      if (blank()) {  // another process may have been faster
        exec(kSchema);
        exec(("PRAGMA application_id = " + std::to_string(kApplicationId) +
              "; PRAGMA user_version = " + std::to_string(kSchemaVersion))
                 .c_str());
      }
      exec("COMMIT");
    }
    const std::int64_t application = pragma("PRAGMA application_id"), version = pragma("PRAGMA user_version");
    if (blank()) throw Error(path_, "it is empty", "import a grid into it: patchwork import DB FILE...");
    if (application != kApplicationId)
      throw Error(path_, "it is a database of another program", "name a Patchwork database or a new file");
    if (version > kSchemaVersion)
      throw Error(path_, "it was written by a newer Patchwork (schema " + std::to_string(version) + ")",
                  "use that version to read it");
    if (version < kSchemaVersion)
      throw Error(path_, "it was written by an older Patchwork (schema " + std::to_string(version) + ")",
                  "import its grids into a new one");
  }

  struct Close {
    void operator()(sqlite3* db) const { sqlite3_close(db); }
  };
  std::string path_;
  std::unique_ptr<sqlite3, Close> connection_;
  sqlite3* db_ = nullptr;  // connection_'s
  bool made_ = false;      // the file
  std::array<Statements, kShelves.size()> statements_;
};

SqliteStore::SqliteStore(const std::string& path, StoreMode mode) : path_(path) {
  if (mode != StoreMode::create && !std::filesystem::exists(path))
    throw Error(path, "there is no such database", "make one with: patchwork import DB FILE...");
  if (std::filesystem::is_directory(path)) throw Error(path, "it is a folder", "name a database file");
  const bool reads = mode == StoreMode::read;
  connect(mode, reads && in_frozen_folder(path) && is_whole(path));
  try {
    prepare_file(mode == StoreMode::create);
  } catch (const Error&) {
    const int code = sqlite3_errcode(db_) & 0xff;
    rollback();
    if (made_ && holds_nothing()) remove_file();  // who waited for it hears that it is gone
    if (code == SQLITE_NOTADB)
      throw Error(path, "it is not a database", "name a Patchwork database or a new file");
    const bool no_room = code == SQLITE_IOERR || code == SQLITE_FULL || code == SQLITE_CANTOPEN;
    if (!reads || !no_room || !is_whole(path)) throw;
    connect(mode, true);
    prepare_file(false);
  }
  exec("PRAGMA synchronous = FULL; PRAGMA cache_size = -16000");
  if (reads) exec("PRAGMA mmap_size = 268435456; PRAGMA query_only = 1");
}

// A reader that may write closes the file behind it: SQLite then takes -wal and -shm away with the last one.
void SqliteStore::connect(StoreMode mode, bool frozen) {
  if (mode == StoreMode::create) {
    const int made = ::open(path_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644);
    made_ = made >= 0;  // else it is there, or SQLite says why it cannot be made
    if (made_) ::close(made);
  }
  const bool look_only = frozen || (mode == StoreMode::read && access(path_.c_str(), W_OK) != 0);
  const int flags = look_only ? SQLITE_OPEN_READONLY
                              : SQLITE_OPEN_READWRITE | (mode == StoreMode::create ? SQLITE_OPEN_CREATE : 0);
  const std::string name = frozen ? frozen_uri(path_) : path_;
  const int how = flags | SQLITE_OPEN_NOMUTEX | (frozen ? SQLITE_OPEN_URI : 0);
  const int opened = sqlite3_open_v2(name.c_str(), &db_, how, nullptr);
  connection_.reset(db_);
  if (opened != SQLITE_OK) throw Error(path_, sqlite3_errmsg(db_), advice_for(SQLITE_CANTOPEN));
  sqlite3_extended_result_codes(db_, 1);
  sqlite3_busy_timeout(db_, kBusyMilliseconds);
}

std::optional<std::string> SqliteStore::fact(const std::string& key) {
  Statement s(db_, path_, "SELECT value FROM fact WHERE key = ?");
  s.bind(1, key);
  return s.step() ? std::optional(s.text(0)) : std::nullopt;
}

void SqliteStore::set_fact(const std::string& key, const std::string& value) {
  Statement s(db_, path_, "INSERT OR REPLACE INTO fact VALUES(?, ?)");
  s.bind(1, key).bind(2, value).run();
}

std::vector<GridInfo> SqliteStore::grids() {
  Statement s(db_, path_, "SELECT id, name, digest, facts, checksum FROM grid ORDER BY id");
  std::vector<GridInfo> out;
  while (s.step()) {
    const std::string what = "the record of grid " + s.text(1);
    const Bytes facts = checked(s.blob(3), s.integer(4), what), digest = s.blob(2);
    GridInfo g;
    try {
      if (facts.size() > kMostFacts) throw std::invalid_argument("it is too long");
      if (s.integer(0) < 1 || s.integer(0) > GridId::kMost) throw std::invalid_argument("an impossible id");
      g = info_from(nlohmann::json::from_cbor(facts));
    } catch (const std::exception& e) {
      throw Error(path_, what + " is damaged: " + e.what(), advice_for(SQLITE_CORRUPT));
    }
    if (digest.size() != g.digest.size()) throw Error(path_, what + " is damaged: no digest");
    std::memcpy(g.digest.data(), digest.data(), digest.size());
    g.id = {std::uint32_t(s.integer(0))}, g.name = s.text(1);
    out.push_back(std::move(g));
  }
  return out;
}

void SqliteStore::put_grid(const GridInfo& info, const char* sql) {
  const std::vector<std::uint8_t> cbor = nlohmann::json::to_cbor(facts_of(info));
  const auto facts = std::as_bytes(std::span(cbor));
  Statement s(db_, path_, sql);
  s.bind(1, info.name).bind(2, std::as_bytes(std::span(info.digest))).bind(3, facts);
  s.bind(4, std::int64_t(checksum(facts)));
  if (info.id.value) s.bind(5, std::int64_t{info.id.value});
  s.run();
}

GridId SqliteStore::add_grid(const GridInfo& info) {
  GridInfo added = info;
  added.id = {std::uint32_t(pragma("SELECT coalesce(max(id), 0) + 1 FROM grid"))};
  if (added.id.value > GridId::kMost)  // then the least that is free
    added.id = {std::uint32_t(pragma(
        "SELECT coalesce(min(id), 0) + 1 FROM (SELECT 0 AS id UNION SELECT id FROM grid) AS taken WHERE "
        "NOT EXISTS (SELECT 1 FROM grid WHERE id = taken.id + 1)"))};
  if (added.id.value > GridId::kMost) throw Error(path_, "it holds as many grids as it can");
  put_grid(added, "INSERT INTO grid(name, digest, facts, checksum, id) VALUES(?, ?, ?, ?, ?)");
  return added.id;
}

void SqliteStore::update_grid(const GridInfo& info) {
  put_grid(info, "UPDATE grid SET name = ?, digest = ?, facts = ?, checksum = ? WHERE id = ?");
}

void SqliteStore::remove_grid(GridId id) {
  Statement s(db_, path_, "DELETE FROM grid WHERE id = ?");
  s.bind(1, std::int64_t{id.value}).run();
}

std::optional<Bytes> SqliteStore::blob(Kind kind, std::uint64_t key) {
  const Shelf& of = shelf(kind);
  auto& statement = statements_[size_t(kind)].get;
  if (!statement)
    statement = std::make_unique<Statement>(
        db_, path_, ("SELECT data, checksum FROM " + of.table + " WHERE id = ?").c_str());
  Statement& s = *statement;
  s.reset();
  s.bind(1, std::int64_t(key));
  if (!s.step()) return s.reset(), std::nullopt;
  Bytes bytes = s.blob(0);
  const std::int64_t sum = s.integer(1);
  s.reset();
  bytes = checked(std::move(bytes), sum, of.what);
  if (!of.packed) return bytes;
  auto unpacked = unpack(bytes, kMostPacked);
  if (!unpacked)
    throw Error(path_, of.what + " is damaged (it cannot be unpacked)", advice_for(SQLITE_CORRUPT));
  return unpacked;
}

void SqliteStore::put_blob(Kind kind, std::uint64_t key, std::span<const std::byte> bytes) {
  const Shelf& of = shelf(kind);
  auto& statement = statements_[size_t(kind)].put;
  if (!statement)
    statement = std::make_unique<Statement>(
        db_, path_, ("INSERT OR REPLACE INTO " + of.table + "(id, checksum, data) VALUES(?, ?, ?)").c_str());
  const Bytes packed = of.packed ? pack(bytes) : Bytes();
  const std::span<const std::byte> stored = of.packed ? packed : bytes;
  Statement& s = *statement;
  s.reset();
  s.bind(1, std::int64_t(key)).bind(2, std::int64_t(checksum(stored))).bind(3, stored).run();
}

void SqliteStore::erase_blobs(Kind kind, std::uint64_t first, std::uint64_t end) {
  Statement s(db_, path_, ("DELETE FROM " + shelf(kind).table + " WHERE id >= ? AND id < ?").c_str());
  s.bind(1, std::int64_t(first)).bind(2, std::int64_t(end)).run();
}

std::vector<std::uint64_t> SqliteStore::keys(Kind kind, std::uint64_t first, std::uint64_t end) {
  Statement s(db_, path_,
              ("SELECT id FROM " + shelf(kind).table + " WHERE id >= ? AND id < ? ORDER BY id").c_str());
  s.bind(1, std::int64_t(first)).bind(2, std::int64_t(end));
  std::vector<std::uint64_t> out;
  while (s.step()) out.push_back(std::uint64_t(s.integer(0)));
  return out;
}

void SqliteStore::note_change(const Change& change) {
  Statement s(db_, path_, "INSERT OR REPLACE INTO change VALUES(?, ?, ?, ?, ?, ?)");
  const Extent& e = change.extent;
  s.bind(1, std::int64_t(change.version)).bind(2, change.what);
  s.bind(3, e.xmin).bind(4, e.ymin).bind(5, e.xmax).bind(6, e.ymax).run();
}

std::vector<Change> SqliteStore::changes_after(std::uint64_t version) {
  Statement s(db_, path_,
              "SELECT version, what, xmin, ymin, xmax, ymax FROM change WHERE version > ? ORDER BY version");
  s.bind(1, std::int64_t(version));
  std::vector<Change> out;
  while (s.step())
    out.push_back({std::uint64_t(s.integer(0)), s.text(1), {s.real(2), s.real(3), s.real(4), s.real(5)}});
  return out;
}

std::vector<std::string> SqliteStore::find_damage() {
  std::vector<std::string> out;
  Statement s(db_, path_, "PRAGMA integrity_check");
  while (s.step())
    if (const std::string line = s.text(0); line != "ok") out.push_back(line);
  return out;
}

std::uint64_t SqliteStore::file_bytes() const {
  std::error_code ignored;
  const auto main = std::filesystem::file_size(path_, ignored);
  const auto wal = std::filesystem::file_size(path_ + "-wal", ignored);
  return std::uint64_t(main) + (ignored ? 0 : std::uint64_t(wal));
}

}  // namespace

std::unique_ptr<Store> open_store(const std::string& path, StoreMode mode) {
  return std::make_unique<SqliteStore>(path, mode);
}

}  // namespace patchwork
