// The command `patchwork`: one verb, one file in verbs/.
#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>

#include <memory>

#include "db/error.h"
#include "tools/cli.h"

namespace {

constexpr int kFailed = 1, kWrongUsage = 2;

}  // namespace

int main(int argc, char** argv) {
  using namespace patchwork;
  CLI::App app(
      "Patchwork: one terrain from any number of overlapping height grids, at the error you ask for.",
      "patchwork");
  app.set_version_flag("--version", std::string("patchwork " PATCHWORK_VERSION));
  app.require_subcommand(1);
  cli::Common common;
  std::unique_ptr<tbb::global_control> threads;
  cli::add_import(app, common);
  cli::add_list(app, common);
  cli::add_info(app, common);
  cli::add_query(app, common);
  cli::add_sample(app, common);
  cli::add_resample(app, common);

  for (CLI::App* v : app.get_subcommands({}))
    v->parse_complete_callback([&] {
      if (common.threads > 0)
        threads = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                        common.threads);
    });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kWrongUsage;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "patchwork: out of memory; lower --memory or ask for less\n");
    return kFailed;
  } catch (const std::exception& e) {
    fmt::print(stderr, "patchwork: {}\n", e.what());
    return kFailed;
  }
  return 0;
}
