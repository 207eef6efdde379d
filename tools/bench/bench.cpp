#include "tools/bench/bench.h"

#include <stdlib.h>

#include <algorithm>

#include "db/error.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

WorkFolder::WorkFolder(const BenchOptions& options) : path_(options.keep), keep_(!options.keep.empty()) {
  if (keep_) {
    std::error_code failed;
    std::filesystem::create_directories(path_, failed);
    if (failed) throw Error(options.keep, "it cannot be made", failed.message());
    return;
  }
  std::string name = (std::filesystem::temp_directory_path() / "patchwork-bench-XXXXXX").string();
  if (!mkdtemp(name.data())) throw Error(name, "a folder cannot be made there", "name one with --keep");
  path_ = name;
  interrupted_.emplace(std::vector<std::string>{name});
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  if (!keep_) std::filesystem::remove_all(path_, ignored);
}

std::string own_program(const std::string& name) {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / name).string();
}

Json make_terrain(const std::string& folder, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{own_program("make_terrain"), folder, "--json"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return Json::parse(run_process(command).output);
}

}  // namespace patchwork::cli
