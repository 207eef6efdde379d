// One prepared SQL statement, and what a person is told when SQLite refuses (used by sqlite_store.cpp).
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <span>
#include <string>

#include "db/error.h"
#include "db/store.h"

namespace patchwork {

/// What to do about an SQLite result code; empty where there is nothing to say.
std::string advice_for(int code);

/// Values are bound by place, from 1; columns are read by place, from 0. Throws Error (path, SQLite's words,
/// advice).
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
  Statement& bind(int at, double v) { return sqlite3_bind_double(s_, at, v), *this; }
  double real(int column) { return sqlite3_column_double(s_, column); }
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

}  // namespace patchwork
