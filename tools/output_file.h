// Files that a verb writes: each takes its place when it is whole, and none is the database or another.
#pragma once

#include <string>
#include <vector>

#include "render/picture.h"
#include "tools/unfinished_files.h"

namespace patchwork {

/// A file is written under another name beside its own, and renamed. Until publish() what was there before
/// stays, and nothing is left behind by a run that fails or is interrupted. What is no regular file (a pipe,
/// a device) is written as it is.
class OutputFile {
 public:
  /// Throws Error: it is a folder.
  explicit OutputFile(const std::string& path);
  const std::string& name() const { return name_; }  ///< to be written to
  void publish();                                    ///< throws Error where it cannot be put in place

 private:
  const std::string path_, target_, name_;  // target_: behind links
  UnfinishedFiles unfinished_;
};

/// A picture as a PNG, by way of an OutputFile. Throws Error.
void write_picture(const std::string& path, const Image& image);

/// Throws Error where one of `outputs` (empty names are none) is the database, or another of them.
void refuse_overwriting(const std::string& database, const std::vector<std::string>& outputs);

}  // namespace patchwork
