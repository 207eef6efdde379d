#include "tools/bench/process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "db/error.h"
#include "db/stopwatch.h"

namespace patchwork::cli {

namespace {

constexpr int kNotThere = 127;  // what shells answer too

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
    read = ends[0], write = ends[1];
  }
  ~Pipe() { close_write(), close(read); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_write() {
    if (write >= 0) close(write);
    write = -1;
  }
};

std::string read_all(int file) {
  std::string text;
  char part[4096];
  for (ssize_t n; (n = read(file, part, sizeof part)) > 0 || (n < 0 && errno == EINTR);)
    if (n > 0) text.append(part, size_t(n));
  return text;
}

}  // namespace

ProcessUse run_process(const std::vector<std::string>& arguments, const std::string& package) {
  // Everything the child needs is made before the fork: between fork and exec it must not allocate.
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  Pipe out;
  const Stopwatch watch;
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    dup2(out.write, STDOUT_FILENO);
    execvp(argv[0], argv.data());
    _exit(kNotThere);
  }
  out.close_write();
  ProcessUse use;
  use.output = read_all(out.read);
  int status = 0;
  rusage resources{};
  while (wait4(child, &status, 0, &resources) < 0)
    if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "wait4");
  use.seconds = watch.seconds();
  use.peak_mib = double(resources.ru_maxrss) / 1024;  // Linux counts KiB
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotThere)
    throw Error(arguments.front(), "the program is not there",
                package.empty() ? "check the path" : "install the package " + package);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw Error(arguments.front(), "the program failed", "its own message stands above");
  return use;
}

}  // namespace patchwork::cli
