// What can be wrong with a database, and setting right what can be derived (used through Database).
#pragma once

#include <string>
#include <vector>

namespace patchwork {

struct Problem {
  std::string what, where;
};

struct RepairReport {
  bool done = false;               ///< false: patch records cannot be read, and nothing was changed
  std::size_t records = 0;         ///< whose top or flag was wrong
  std::size_t strays = 0;          ///< blobs that belonged to no grid
  std::vector<Problem> remaining;  ///< what cannot be derived: heights, and errors measured at import
};

}  // namespace patchwork
