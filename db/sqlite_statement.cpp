#include "db/sqlite_statement_impl.h"

namespace patchwork {

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

}  // namespace patchwork
