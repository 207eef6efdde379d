// Files that a failed or interrupted run must not leave behind.
#pragma once

#include <string>
#include <vector>

namespace patchwork {

/// Removes the files, where they exist, when it goes out of scope or when SIGINT, SIGTERM or SIGHUP ends the
/// process, unless keep() was called; folders with all in them only at a signal, by rm. Several may live at a
/// time, the last made going first. Not safe for concurrent use.
class UnfinishedFiles {
 public:
  explicit UnfinishedFiles(std::vector<std::string> paths);
  ~UnfinishedFiles();
  UnfinishedFiles(const UnfinishedFiles&) = delete;
  UnfinishedFiles& operator=(const UnfinishedFiles&) = delete;
  /// They are finished, or gone under another name: they stay.
  void keep();

 private:
  static void remove_all_and_die(int signal);
  void remove() const;
  void remove_folders() const;

  const std::vector<std::string> paths_;
  UnfinishedFiles* const outer_;
  volatile bool kept_ = false;
};

}  // namespace patchwork
