// patchwork export: a grid's own samples back into a GeoTIFF.
#include <fmt/format.h>

#include "db/stopwatch.h"
#include "tools/cli.h"
#include "tools/output_file.h"
#include "tools/sample_dataset.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database, name, file;
};

void run(const Options& o, const Common& common) {
  const Stopwatch watch;
  const Database db = Database::open(o.database, common.memory);
  refuse_overwriting(o.database, {o.file});
  const Grid& grid = db.grid(o.name);
  const double megasamples = double(grid.info.shape.width()) * grid.info.shape.height() / 1e6;
  ProgressBar bar(common, "export " + o.name, megasamples, "Msamples");
  const std::string type = write_samples(db, grid.info, o.file, [&](double share) { bar.show(share); });
  if (grid.info.quantisation > 0)
    note(common, fmt::format("{}: stored to within {:g} m of its file", o.name, grid.info.quantisation));
  if (common.json)
    print({{"name", o.name},
           {"file", o.file},
           {"width", grid.info.shape.width()},
           {"height", grid.info.shape.height()},
           {"type", type},
           {"quantisation", grid.info.quantisation},
           {"seconds", watch.seconds()}});
  else if (!common.quiet)
    fmt::print("{}: {} x {} samples of {} in {}\n", o.name, grid.info.shape.width(), grid.info.shape.height(),
               type, o.file);
}

}  // namespace

void add_export(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "export", "write a grid's samples back into a GeoTIFF");
  v->add_option("DB", o->database, "the database")->required();
  v->add_option("NAME", o->name, "the grid (see: patchwork list)")->required();
  v->add_option("OUT", o->file, "the GeoTIFF; one that is there is replaced")->required();
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
