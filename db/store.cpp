// The SQLite form of the store: one file in WAL mode, one table a kind of thing (schema below).
#include "db/store.h"

#include <sqlite3.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "db/codec.h"
#include "db/error.h"

namespace patchwork {

namespace {

constexpr int kApplicationId = 0x50776b31;  // "Pwk1", frozen
constexpr int kSchemaVersion = 1;
constexpr int kBusyMilliseconds = 10000;
constexpr std::size_t kPatchesPerRow = 4096;  // records of one row of `patches`: what an update rewrites

constexpr const char* kSchema = R"(
  CREATE TABLE fact(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE grid(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, digest BLOB NOT NULL UNIQUE, facts BLOB NOT NULL,
                    checksum INTEGER NOT NULL);
  CREATE TABLE patches(grid INTEGER NOT NULL, run INTEGER NOT NULL, data BLOB NOT NULL, checksum INTEGER NOT NULL,
                       PRIMARY KEY(grid, run)) WITHOUT ROWID;
  CREATE TABLE tree_page(id INTEGER PRIMARY KEY, data BLOB NOT NULL, checksum INTEGER NOT NULL);
  CREATE TABLE payload(id INTEGER PRIMARY KEY, checksum INTEGER NOT NULL, data BLOB NOT NULL);
)";
constexpr std::int64_t kOffersRun = 1 << 30;  // the run of `patches` that holds a grid's offers

// In a folder that is read-only SQLite cannot make the -shm file that a reader needs; where no -wal lies
// beside it, the file alone is the whole state. CAVEAT: a writer with more rights than ours is then not seen.
bool is_frozen(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  return access(folder.c_str(), W_OK) != 0 && !std::filesystem::exists(path + "-wal");
}

std::string frozen_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) uri += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
  return uri + "?immutable=1";
}

std::string advice_for(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "free some space; the database is as it was before";
    case SQLITE_IOERR:
      return "check the disk and its free space; the database is as it was before";
    case SQLITE_BUSY:
      return "another process is writing; try again when it is done";
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return "make the file and its folder writable";
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return "restore it from a copy, or import its grids again";
    case SQLITE_CANTOPEN:
      return "check the path and its folder";
    default:
      return "";
  }
}

class Statement {
 public:
  Statement(sqlite3* db, const std::string& path, const char* sql) : db_(db), path_(path) {
    if (sqlite3_prepare_v3(db, sql, -1, SQLITE_PREPARE_PERSISTENT, &s_, nullptr) != SQLITE_OK) fail();
  }
  ~Statement() { sqlite3_finalize(s_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(int at, std::int64_t v) { return sqlite3_bind_int64(s_, at, v), *this; }
  Statement& bind(int at, const std::string& v) {
    return sqlite3_bind_text(s_, at, v.data(), int(v.size()), SQLITE_TRANSIENT), *this;
  }
  Statement& bind(int at, std::span<const std::byte> v) {
    return sqlite3_bind_blob64(s_, at, v.data() ? v.data() : static_cast<const void*>(""), v.size(),
                               SQLITE_STATIC),
           *this;
  }
  bool step() {
    const int code = sqlite3_step(s_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail();
    return code == SQLITE_ROW;
  }
  void run() { step(), sqlite3_reset(s_); }
  void reset() { sqlite3_reset(s_); }
  std::int64_t integer(int column) { return sqlite3_column_int64(s_, column); }
  std::string text(int column) {
    const auto* p = reinterpret_cast<const char*>(sqlite3_column_text(s_, column));
    return p ? std::string(p, size_t(sqlite3_column_bytes(s_, column))) : std::string();
  }
  Bytes blob(int column) {
    const auto* p = static_cast<const std::byte*>(sqlite3_column_blob(s_, column));
    return p ? Bytes(p, p + sqlite3_column_bytes(s_, column)) : Bytes();
  }

 private:
  [[noreturn]] void fail() {
    const int code = sqlite3_extended_errcode(db_);
    const std::string problem = sqlite3_errmsg(db_);
    sqlite3_reset(s_);
    throw Error(path_, problem, advice_for(code));
  }
  sqlite3* db_;
  const std::string& path_;
  sqlite3_stmt* s_ = nullptr;
};

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
          {"holes", g.holes},
          {"sample_bytes", g.sample_bytes}};
}

GridInfo info_from(const nlohmann::json& f) {
  GridInfo g;
  const int width = f.at("width"), height = f.at("height");
  if (width < 2 || height < 2) throw Error("grid", "an impossible size");
  g.shape = GridShape(width, height, f.at("area"));
  g.frame = Frame::from_trusted(f.at("frame").get<std::array<double, 6>>());
  g.accuracy = f.at("accuracy"), g.quantum = f.at("quantum"), g.base = f.at("base");
  g.code_origin = f.at("code_origin"), g.quantisation = f.at("quantisation"), g.rim_error = f.at("rim_error");
  g.holes = f.at("holes"), g.sample_bytes = f.at("sample_bytes");
  return g;
}

template <class T>
std::vector<T> records_from(const Bytes& bytes, const std::string& path) {
  if (bytes.size() % sizeof(T)) throw Error(path, "patch records are cut short", advice_for(SQLITE_CORRUPT));
  std::vector<T> out(bytes.size() / sizeof(T));
  if (!out.empty()) std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

}  // namespace

struct Store::Impl {
  std::string path;
  sqlite3* db = nullptr;
  std::unique_ptr<Statement> get_payload, add_payload;

  ~Impl() {
    get_payload.reset(), add_payload.reset();
    sqlite3_close(db);
  }
  void exec(const char* sql) {
    if (sqlite3_exec(db, sql, nullptr, nullptr, nullptr) != SQLITE_OK)
      throw Error(path, sqlite3_errmsg(db), advice_for(sqlite3_extended_errcode(db)));
  }
  std::int64_t pragma(const char* sql) {
    Statement s(db, path, sql);
    return s.step() ? s.integer(0) : 0;
  }
  Bytes checked(Bytes bytes, std::int64_t sum, const char* what) {
    if (checksum(bytes) != std::uint64_t(sum))
      throw Error(path, std::string(what) + " is damaged (its checksum differs)", advice_for(SQLITE_CORRUPT));
    return bytes;
  }
  void prepare_file(bool may_create) {
    const std::int64_t application = pragma("PRAGMA application_id"), version = pragma("PRAGMA user_version");
    const bool blank = application == 0 && version == 0 && pragma("SELECT count(*) FROM sqlite_schema") == 0;
    if (blank && may_create) {  // pages of 4 KiB: with 8 KiB Puget Sound (1025^2, 16 bit) took 6 % more,
                                // above its raw samples
      exec("PRAGMA page_size = 4096; PRAGMA journal_mode = WAL; BEGIN IMMEDIATE");
      exec(kSchema);
      exec(("PRAGMA application_id = " + std::to_string(kApplicationId) +
            "; PRAGMA user_version = " + std::to_string(kSchemaVersion) + "; COMMIT")
               .c_str());
      return;
    }
    if (application != kApplicationId)
      throw Error(path, "it is a database of another program", "name a Patchwork database or a new file");
    if (version > kSchemaVersion)
      throw Error(path, "it was written by a newer Patchwork (schema " + std::to_string(version) + ")",
                  "use that version to read it");
  }
  Bytes patch_run(const GridInfo& grid, std::int64_t run) {
    Statement s(db, path, "SELECT data, checksum FROM patches WHERE grid = ? AND run = ?");
    s.bind(1, grid.id.value).bind(2, run);
    return s.step() ? checked(s.blob(0), s.integer(1), "a run of patch records") : Bytes();
  }
  void put_grid(const GridInfo& info, const char* sql) {
    const std::vector<std::uint8_t> cbor = nlohmann::json::to_cbor(facts_of(info));
    const auto facts = std::as_bytes(std::span(cbor));
    Statement s(db, path, sql);
    s.bind(1, info.name).bind(2, std::as_bytes(std::span(info.digest))).bind(3, facts);
    s.bind(4, std::int64_t(checksum(facts)));
    if (info.id.value) s.bind(5, info.id.value);
    s.run();
  }
  void put_run(const GridInfo& grid, std::int64_t run, std::span<const std::byte> bytes) {
    Statement s(db, path, "INSERT OR REPLACE INTO patches VALUES(?, ?, ?, ?)");
    s.bind(1, grid.id.value).bind(2, run).bind(3, bytes).bind(4, std::int64_t(checksum(bytes))).run();
  }
};

Store::Store(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;
Store::~Store() = default;
const std::string& Store::path() const { return impl_->path; }

Store Store::open(const std::string& path, Mode mode) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  const int flags = mode == Mode::read
                        ? SQLITE_OPEN_READONLY
                        : SQLITE_OPEN_READWRITE | (mode == Mode::create ? SQLITE_OPEN_CREATE : 0);
  if (mode != Mode::create && !std::filesystem::exists(path))
    throw Error(path, "there is no such database", "make one with: patchwork import DB FILE...");
  if (std::filesystem::is_directory(path)) throw Error(path, "it is a folder", "name a database file");
  const bool frozen = mode == Mode::read && is_frozen(path);
  const std::string name = frozen ? frozen_uri(path) : path;
  const int how = flags | SQLITE_OPEN_NOMUTEX | (frozen ? SQLITE_OPEN_URI : 0);
  if (sqlite3_open_v2(name.c_str(), &impl->db, how, nullptr) != SQLITE_OK)
    throw Error(path, sqlite3_errmsg(impl->db), advice_for(SQLITE_CANTOPEN));
  sqlite3_extended_result_codes(impl->db, 1);
  sqlite3_busy_timeout(impl->db, kBusyMilliseconds);
  try {
    impl->prepare_file(mode == Mode::create);
  } catch (const Error&) {
    if (sqlite3_errcode(impl->db) == SQLITE_NOTADB)
      throw Error(path, "it is not a database", "name a Patchwork database or a new file");
    throw;
  }
  impl->exec("PRAGMA synchronous = NORMAL; PRAGMA cache_size = -16000; PRAGMA mmap_size = 268435456");
  impl->get_payload =
      std::make_unique<Statement>(impl->db, impl->path, "SELECT data, checksum FROM payload WHERE id = ?");
  impl->add_payload = std::make_unique<Statement>(impl->db, impl->path,
                                                  "INSERT INTO payload(id, checksum, data) VALUES(?, ?, ?)");
  return Store(std::move(impl));
}

void Store::begin_read() {
  impl_->exec("BEGIN");
  impl_->pragma("SELECT count(*) FROM fact");  // the snapshot is taken by the first read
}
void Store::begin_write() { impl_->exec("BEGIN IMMEDIATE"); }
void Store::commit() { impl_->exec("COMMIT"); }
void Store::rollback() {
  if (!sqlite3_get_autocommit(impl_->db)) sqlite3_exec(impl_->db, "ROLLBACK", nullptr, nullptr, nullptr);
}

std::optional<std::string> Store::fact(const std::string& key) {
  Statement s(impl_->db, impl_->path, "SELECT value FROM fact WHERE key = ?");
  s.bind(1, key);
  return s.step() ? std::optional(s.text(0)) : std::nullopt;
}

void Store::set_fact(const std::string& key, const std::string& value) {
  Statement s(impl_->db, impl_->path, "INSERT OR REPLACE INTO fact VALUES(?, ?)");
  s.bind(1, key).bind(2, value).run();
}

std::vector<GridInfo> Store::grids() {
  Statement s(impl_->db, impl_->path, "SELECT id, name, digest, facts, checksum FROM grid ORDER BY id");
  std::vector<GridInfo> out;
  while (s.step()) {
    const Bytes facts = impl_->checked(s.blob(3), s.integer(4), "the record of a grid"), digest = s.blob(2);
    GridInfo g = info_from(nlohmann::json::from_cbor(facts));
    if (digest.size() != g.digest.size()) throw Error(impl_->path, "a grid's digest is damaged");
    std::memcpy(g.digest.data(), digest.data(), digest.size());
    g.id = {std::uint32_t(s.integer(0))}, g.name = s.text(1);
    out.push_back(std::move(g));
  }
  return out;
}

GridId Store::add_grid(const GridInfo& info) {
  impl_->put_grid(info, "INSERT INTO grid(name, digest, facts, checksum, id) VALUES(?, ?, ?, ?, ?)");
  return {std::uint32_t(sqlite3_last_insert_rowid(impl_->db))};
}

void Store::update_grid(const GridInfo& info) {
  impl_->put_grid(info, "UPDATE grid SET name = ?, digest = ?, facts = ?, checksum = ? WHERE id = ?");
}

std::vector<PatchRecord> Store::patches(const GridInfo& grid) {
  std::vector<PatchRecord> out;
  while (out.size() < grid.shape.blocks()) {
    const auto run = records_from<PatchRecord>(
        impl_->patch_run(grid, std::int64_t(out.size() / kPatchesPerRow)), impl_->path);
    if (run.empty() || run.size() > grid.shape.blocks() - out.size())
      throw Error(impl_->path, "patch records of " + grid.name + " are missing", advice_for(SQLITE_CORRUPT));
    out.insert(out.end(), run.begin(), run.end());
  }
  return out;
}

std::vector<Offer> Store::offers(const GridInfo& grid) {
  return records_from<Offer>(impl_->patch_run(grid, kOffersRun), impl_->path);
}

void Store::put_patches(const Grid& grid, std::span<const std::size_t> changed) {
  const std::size_t runs = (grid.patches.size() + kPatchesPerRow - 1) / kPatchesPerRow;
  std::vector<char> dirty(runs, changed.empty());
  for (const std::size_t k : changed) dirty[k / kPatchesPerRow] = 1;
  for (std::size_t r = 0; r < runs; ++r) {
    const std::size_t first = r * kPatchesPerRow, n = std::min(kPatchesPerRow, grid.patches.size() - first);
    if (dirty[r])
      impl_->put_run(grid.info, std::int64_t(r), std::as_bytes(std::span(grid.patches).subspan(first, n)));
  }
}

void Store::put_offers(const Grid& grid) {
  impl_->put_run(grid.info, kOffersRun, std::as_bytes(std::span(grid.offers)));
}

std::vector<std::pair<std::uint32_t, Bytes>> Store::tree_pages() {
  Statement s(impl_->db, impl_->path, "SELECT id, data, checksum FROM tree_page ORDER BY id");
  std::vector<std::pair<std::uint32_t, Bytes>> out;
  while (s.step())
    out.emplace_back(std::uint32_t(s.integer(0)),
                     impl_->checked(s.blob(1), s.integer(2), "a page of the R-tree"));
  return out;
}

void Store::put_tree_page(std::uint32_t page, std::span<const std::byte> bytes) {
  Statement s(impl_->db, impl_->path, "INSERT OR REPLACE INTO tree_page VALUES(?, ?, ?)");
  s.bind(1, page).bind(2, bytes).bind(3, std::int64_t(checksum(bytes))).run();
}

void Store::erase_tree_page(std::uint32_t page) {
  Statement s(impl_->db, impl_->path, "DELETE FROM tree_page WHERE id = ?");
  s.bind(1, page).run();
}

void Store::erase_tree() { impl_->exec("DELETE FROM tree_page"); }

std::optional<Bytes> Store::payload(GridId grid, int level, int cx, int cy) {
  Statement& s = *impl_->get_payload;
  s.reset();
  s.bind(1, std::int64_t(PatchId::make(grid, level, cx, cy).value));
  if (!s.step()) return s.reset(), std::nullopt;
  Bytes bytes = s.blob(0);
  const std::int64_t sum = s.integer(1);
  s.reset();
  return impl_->checked(std::move(bytes), sum, "a payload chunk");
}

void Store::put_payload(GridId grid, int level, int cx, int cy, std::span<const std::byte> bytes) {
  Statement& s = *impl_->add_payload;
  s.reset();
  s.bind(1, std::int64_t(PatchId::make(grid, level, cx, cy).value)).bind(2, std::int64_t(checksum(bytes)));
  s.bind(3, bytes).run();
}

std::uint64_t Store::file_bytes() const {
  std::error_code ignored;
  const auto main = std::filesystem::file_size(impl_->path, ignored);
  const auto wal = std::filesystem::file_size(impl_->path + "-wal", ignored);
  return std::uint64_t(main) + (ignored ? 0 : std::uint64_t(wal));
}

}  // namespace patchwork
