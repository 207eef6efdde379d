// The one family of exceptions that Patchwork throws for input, files and devices.
#pragma once

#include <stdexcept>
#include <string>

namespace patchwork {

/// What went wrong, where, and what to do about it. `what()` is the one line that a person is shown.
class Error : public std::runtime_error {
 public:
  /// `where` names a file, grid or option; `advice` may be empty.
  Error(const std::string& where, const std::string& problem, const std::string& advice = {})
      : std::runtime_error(where + ": " + problem + (advice.empty() ? "" : "; " + advice)),
        problem_(problem) {}
  /// What went wrong alone, for lists of problems.
  const std::string& problem() const { return problem_; }

 private:
  std::string problem_;
};

}  // namespace patchwork
