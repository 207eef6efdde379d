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
  /// open: somebody else may be at work on them; a first signal waits until that is known, a second one does
  /// not.
  enum class Fate { remove, open };
  explicit UnfinishedFiles(std::vector<std::string> paths, Fate fate = Fate::remove);
  ~UnfinishedFiles();
  UnfinishedFiles(const UnfinishedFiles&) = delete;
  UnfinishedFiles& operator=(const UnfinishedFiles&) = delete;
  /// They are finished, or gone under another name: they stay.
  void keep();
  /// From now on. A signal that waits ends the process when they are no longer open.
  void set(Fate fate);

 private:
  static void remove_all_and_die(int signal);
  void remove() const;
  void remove_folders() const;

  const std::vector<std::string> paths_;
  UnfinishedFiles* const outer_;
  volatile bool kept_ = false, open_;
};

}  // namespace patchwork
