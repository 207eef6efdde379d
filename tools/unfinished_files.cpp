#include "tools/unfinished_files.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <utility>

namespace patchwork {

namespace {

std::atomic<UnfinishedFiles*> innermost = nullptr;
static_assert(std::atomic<UnfinishedFiles*>::is_always_lock_free, "a signal handler reads it");

// A signal that the parent has silenced (nohup) stays silent.
void handle(int signal, void (*handler)(int)) {
  if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);
}

}  // namespace

UnfinishedFiles::UnfinishedFiles(std::vector<std::string> paths)
    : paths_(std::move(paths)), outer_(innermost) {
  innermost = this;
  if (outer_ == nullptr)
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) handle(signal, remove_all_and_die);
}

UnfinishedFiles::~UnfinishedFiles() {
  remove();
  innermost = outer_;
  if (outer_ == nullptr)
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) handle(signal, SIG_DFL);
}

void UnfinishedFiles::keep() { kept_ = true; }

// Nothing but unlink(2): it is among the few calls that a signal handler may make.
void UnfinishedFiles::remove() const {
  if (kept_) return;
  for (const std::string& path : paths_) unlink(path.c_str());
}

// So are _Fork and execl.
void UnfinishedFiles::remove_folders() const {
  for (const std::string& path : paths_)
    if (!kept_ && unlink(path.c_str()) != 0 && errno == EISDIR && _Fork() == 0) {
      execl("/bin/rm", "rm", "-rf", path.c_str(), nullptr);
      _exit(1);
    }
}

void UnfinishedFiles::remove_all_and_die(int signal) {
  for (const UnfinishedFiles* files = innermost; files != nullptr; files = files->outer_)
    files->remove(), files->remove_folders();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace patchwork
