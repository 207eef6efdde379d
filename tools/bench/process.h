// A program run to its end as a child process, and what it took.
#pragma once

#include <string>
#include <vector>

namespace patchwork::cli {

struct ProcessUse {
  double seconds = 0;  ///< of the wall clock
  double peak_mib =
      0;  ///< largest resident set. CAVEAT: never less than this process has when it starts the child
  std::string output;  ///< what it wrote to stdout
};

/// Runs `arguments`, the first of them looked up in the PATH. Throws Error: it is not there (naming the
/// Debian `package` that has it), it failed.
ProcessUse run_process(const std::vector<std::string>& arguments, const std::string& package = {});

}  // namespace patchwork::cli
