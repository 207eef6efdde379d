// The command `patchwork`: one verb, one file in verbs/.
#include <fmt/format.h>
#include <gdal.h>
#include <malloc.h>
#include <oneapi/tbb/global_control.h>

#include <cstdio>
#include <memory>

#include "db/error.h"
#include "tools/cli.h"

namespace {

constexpr int kFailed = 1, kWrongUsage = 2;
constexpr std::uint64_t kGdalShare = 64;  // of the memory setting: GDAL's blocks; files are read row by row

// Large blocks come and go: GDAL makes every tile of a file in memory that grows by a tenth at a time, an
// import builds its levels band by band. With glibc's first thresholds each goes back to the system and
// faults in anew: 0.5 s of the 0.6 s that writing 4096 x 4096 uncompressed pixels took.
void keep_freed_heap() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
}

// Not by fmt::print, which throws where stderr cannot be written.
void complain(const std::string& what) { std::fputs(("patchwork: " + what + "\n").c_str(), stderr); }

}  // namespace

int main(int argc, char** argv) {
  using namespace patchwork;
  keep_freed_heap();
  CLI::App app(
      "Patchwork: one terrain from any number of overlapping height grids, at the error you ask for.",
      "patchwork");
  app.set_version_flag("--version", std::string("patchwork " PATCHWORK_VERSION));
  app.require_subcommand(1);
  cli::Common common;
  std::unique_ptr<tbb::global_control> threads;
  cli::add_import(app, common);
  cli::add_remove(app, common);
  cli::add_export(app, common);
  cli::add_check(app, common);
  cli::add_list(app, common);
  cli::add_info(app, common);
  cli::add_query(app, common);
  cli::add_sample(app, common);
  cli::add_profile(app, common);
  cli::add_sight(app, common);
  cli::add_accuracy(app, common);
  cli::add_volume(app, common);
  cli::add_resample(app, common);
  cli::add_cost(app, common);
  cli::add_render(app, common);
  cli::add_selftest(app, common);
  cli::add_view(app, common);
  cli::add_bench(app, common);

  for (CLI::App* v : app.get_subcommands({}))
    v->parse_complete_callback([&] {
      GDALSetCacheMax64(GIntBig(common.memory / kGdalShare));
      if (common.threads > 0)
        threads = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                        common.threads);
    });
  try {
    app.parse(argc, argv);
    if (std::fflush(stdout) != 0) throw Error("standard output", "it cannot be written", "is the disk full?");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kWrongUsage;
  } catch (const std::bad_alloc&) {
    complain("out of memory; lower --memory or ask for less");
    return kFailed;
  } catch (const std::exception& e) {
    complain(e.what());
    return kFailed;
  }
  return 0;
}
