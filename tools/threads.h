// How many threads may work at once.
#pragma once

#include <oneapi/tbb/global_control.h>

#include <cstddef>

namespace patchwork {

/// Those that the process allows itself (the command line's --threads); for libraries with threads of their
/// own.
inline std::size_t allowed_threads() {
  using Threads = oneapi::tbb::global_control;
  return Threads::active_value(Threads::max_allowed_parallelism);
}

}  // namespace patchwork
