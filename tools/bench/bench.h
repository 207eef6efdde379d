// What the benchmarks of `patchwork bench` share: works with their peers, a folder, test terrains.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/cli.h"
#include "tools/spread.h"
#include "tools/unfinished_files.h"

namespace patchwork::cli {

struct BenchOptions {
  int size = 4097;   ///< samples, and pixels + 1, along each side
  int runs = 5;      ///< measured; one more of each side comes before to warm up
  int threads = 2;   ///< given to both sides
  int seconds = 60;  ///< that readers are kept busy
  std::string file;  ///< of heights for `codec`, `blend` and `render`; empty: a made terrain
  std::string keep;  ///< folder to work in and to leave; empty: a temporary one
};

/// One figure of ours beside the peers' figures of the same run.
struct Work {
  std::string work, unit;
  bool lower_is_better = true;
  Spread ours;
  std::vector<std::pair<std::string, Spread>> peers;
  Json answer;  ///< what was computed
};

/// Each measures ours and the peers in turns, A B A B. Throws Error where a peer's program is missing.
std::vector<Work> bench_blend(const BenchOptions& options);
std::vector<Work> bench_codec(const BenchOptions& options);
std::vector<Work> bench_effects(const BenchOptions& options);
std::vector<Work> bench_flight(const BenchOptions& options);
std::vector<Work> bench_import(const BenchOptions& options);
std::vector<Work> bench_query(const BenchOptions& options);
std::vector<Work> bench_readers(const BenchOptions& options);
std::vector<Work> bench_render(const BenchOptions& options);
std::vector<Work> bench_resample(const BenchOptions& options);
std::vector<Work> bench_tiles(const BenchOptions& options);
std::vector<Work> bench_update(const BenchOptions& options);

/// The folder of a benchmark's files: removed with all in it, unless the options say where to keep it.
class WorkFolder {
 public:
  explicit WorkFolder(const BenchOptions& options);
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  std::string path(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
  bool keep_;
  std::optional<UnfinishedFiles> interrupted_;
};

/// A program of ours: it lies beside this executable.
std::string own_program(const std::string& name);
/// Runs make_terrain into `folder` and returns what it says of its files (terrain.json).
Json make_terrain(const std::string& folder, const std::vector<std::string>& arguments);

}  // namespace patchwork::cli
