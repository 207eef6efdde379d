#include "tools/unfinished_files.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <utility>

namespace patchwork {

namespace {

std::atomic<UnfinishedFiles*> innermost = nullptr;
std::atomic<int> waiting = 0;  // a signal
static_assert(std::atomic<UnfinishedFiles*>::is_always_lock_free && std::atomic<int>::is_always_lock_free,
              "a signal handler reads them");

// A signal that the parent has silenced (nohup) stays silent.
void handle(int signal, void (*handler)(int)) {
  if (std::signal(signal, handler) == SIG_IGN) std::signal(signal, SIG_IGN);
}

}  // namespace

UnfinishedFiles::UnfinishedFiles(std::vector<std::string> paths, Fate fate)
    : paths_(std::move(paths)), outer_(innermost), open_(fate == Fate::open) {
  innermost = this;
  if (outer_ == nullptr)
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) handle(signal, remove_all_and_die);
}

UnfinishedFiles::~UnfinishedFiles() {
  remove();
  innermost = outer_;
  if (outer_ == nullptr)
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) handle(signal, SIG_DFL);
  if (const int signal = waiting.exchange(0)) std::raise(signal);
}

void UnfinishedFiles::keep() {
  kept_ = true;
  set(Fate::remove);
}

void UnfinishedFiles::set(Fate fate) {
  open_ = fate == Fate::open;
  if (open_) return;
  if (const int signal = waiting.exchange(0)) std::raise(signal);
}

// Nothing but unlink(2): it is among the few calls that a signal handler may make.
void UnfinishedFiles::remove() const {
  if (kept_ || open_) return;
  for (const std::string& path : paths_) unlink(path.c_str());
}

// So are _Fork and execl.
void UnfinishedFiles::remove_folders() const {
  for (const std::string& path : paths_)
    if (!kept_ && !open_ && unlink(path.c_str()) != 0 && errno == EISDIR && _Fork() == 0) {
      execl("/bin/rm", "rm", "-rf", path.c_str(), nullptr);
      _exit(1);
    }
}

void UnfinishedFiles::remove_all_and_die(int signal) {
  bool open = false;
  for (const UnfinishedFiles* files = innermost; files != nullptr; files = files->outer_)
    open |= files->open_;
  int none = 0;
  if (open && waiting.compare_exchange_strong(none, signal)) return;
  for (const UnfinishedFiles* files = innermost; files != nullptr; files = files->outer_)
    files->remove(), files->remove_folders();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace patchwork
