// Runs the executables as a shell would, and what the tests of the command line share.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "db/database.h"
#include "tests/db/raster_files.h"

namespace patchwork {

using Words = std::vector<std::string>;
using Json = nlohmann::json;

/// How a command is started; what is not set is as a shell has it.
struct Circumstances {
  std::string input = {};               ///< on its standard input
  std::string output = {};              ///< a file for its standard output, e.g. /dev/full
  std::function<void()> in_child = {};  ///< limits and rights, set between fork and exec
  std::function<void(pid_t)> meanwhile = {};
};

struct Outcome {
  int code = -1;   ///< of exit; -1 where a signal ended it
  int signal = 0;  ///< that ended it
  std::string out, err;
};

inline std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_text(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// 600 m of hills, smooth at the grids' steps.
inline double hills(double x, double y) {
  return 300 + 40 * std::sin(x / 170) * std::cos(y / 230) + 0.05 * (x - 500000);
}

class CliTest : public RasterTest {
 protected:
  /// A grid of the hills: float32, EPSG:26710, `step` metres, north-west corner at (500000 + x, 5000000 + y).
  static RasterFile hill_file(int width = 60, int height = 50, double x = 0, double y = 0, double step = 10) {
    RasterFile f{.width = width, .height = height};
    f.geotransform = {500000 + x, step, 0, 5000000 + y, 0, -step};
    f.at = [gt = f.geotransform](int i, int j) {
      return std::round(256 * hills(gt[0] + (i + 0.5) * gt[1], gt[3] + (j + 0.5) * gt[5])) / 256;
    };
    return f;
  }

  Outcome run_program(const std::string& program, const Words& words, const Circumstances& c = {}) const {
    const std::string in = in_directory("stdin"), err = in_directory("stderr");
    const std::string out = c.output.empty() ? in_directory("stdout") : c.output;
    write_text(in, c.input);
    const pid_t child = fork();
    if (child == 0) {
      redirect(in, O_RDONLY, STDIN_FILENO);
      redirect(out, O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
      redirect(err, O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
      std::vector<char*> argv{const_cast<char*>(program.c_str())};
      for (const std::string& w : words) argv.push_back(const_cast<char*>(w.c_str()));
      argv.push_back(nullptr);
      if (c.in_child) c.in_child();
      execv(program.c_str(), argv.data());
      _exit(127);
    }
    if (c.meanwhile) c.meanwhile(child);
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, WIFSIGNALED(status) ? WTERMSIG(status) : 0,
            c.output.empty() ? text_of(out) : "", text_of(err)};
  }
  Outcome run(const Words& words, const Circumstances& c = {}) const {
    return run_program(PATCHWORK_EXECUTABLE, words, c);
  }

  /// The one JSON document that a successful command leaves on stdout.
  Json json(const Words& words) const {
    const Outcome o = run(words);
    EXPECT_EQ(o.code, 0) << o.err;
    const Json document = Json::parse(o.out, nullptr, false);
    EXPECT_FALSE(document.is_discarded()) << o.out;
    return document;
  }
  static std::string content_hash(const std::string& database) {
    return Database::open(database).content_hash();
  }

  /// A database of one hill grid, named hills, accuracy 0.1 m. The command makes it once, then it is copied.
  std::string hill_database(const std::string& name = "hills.pwk") const {
    static std::string bytes;
    const std::string database = in_directory(name), file = make(hill_file(), "hills.tif");
    if (bytes.empty()) {
      EXPECT_EQ(run({"import", database, file, "--accuracy", "0.1", "--quiet"}).code, 0);
      bytes = text_of(database);
    } else {
      write_text(database, bytes);
    }
    return database;
  }

 private:
  static void redirect(const std::string& path, int flags, int to) {
    const int from = open_file(path, flags);
    if (from < 0 || dup2(from, to) < 0) _exit(126);
    close(from);
  }
  static int open_file(const std::string& path, int flags) { return ::open(path.c_str(), flags, 0644); }
};

/// What a person is shown of a failure: one line on stderr (beside notes of other kinds), exit code 1.
inline std::string complaint(const Outcome& o) {
  std::string found;
  for (const std::string& line : lines_of(o.err))
    if (line.starts_with("patchwork: ")) found += found.empty() ? line.substr(11) : "\n" + line;
  return o.code == 1 ? found : "exit code " + std::to_string(o.code) + ": " + o.err;
}

}  // namespace patchwork
