// patchwork remove: a grid out of a database, in one transaction.
#include <fmt/format.h>

#include "tools/cli.h"

namespace patchwork::cli {

namespace {

void run(const std::string& path, const std::string& name, const Common& common) {
  Database db = Database::open_existing(path, common.memory);
  const RemoveReport r = db.remove(name);
  if (common.json)
    print({{"name", r.name},
           {"patches", r.patches},
           {"woken", r.woken},
           {"raised", r.raised},
           {"extent", to_json(r.extent)},
           {"version", db.version()},
           {"seconds", r.seconds}});
  else if (!common.quiet)
    fmt::print(
        "{}: removed {} patches; {} of other grids are needed again, {} up to a larger error; {:.2f} s\n",
        r.name, r.patches, r.woken, r.raised, r.seconds);
}

}  // namespace

void add_remove(CLI::App& app, Common& common) {
  auto path = std::make_shared<std::string>(), name = std::make_shared<std::string>();
  CLI::App* v = verb(app, common, "remove", "take a grid out of a database");
  v->add_option("DB", *path, "the database")->required();
  v->add_option("NAME", *name, "the grid (see: patchwork list)")->required();
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([path, name, &common] { run(*path, *name, common); });
}

}  // namespace patchwork::cli
