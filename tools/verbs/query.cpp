// patchwork query: the extraction itself, and what it cost.
#include <fmt/format.h>

#include "tools/cli.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database;
  double error = 0;
  bool strict = false, list = false;
  RegionOptions region;
};

Json json_of(const Database& db, PatchId id) {
  const Grid& g = db.grid(id.grid());
  const PatchRecord p = db.patch(id);
  const LatticeRect k = g.info.shape.kernel(id.level(), id.bx(), id.by());
  const Point c = g.info.frame.to_domain(0.5 * (k.i0 + k.i1), 0.5 * (k.j0 + k.j1));
  return {{"grid", g.info.name},
          {"level", id.level()},
          {"block", {id.bx(), id.by()}},
          {"centre", {c.x, c.y}},
          {"size", {(k.i1 - k.i0) * g.info.frame.step_i(), (k.j1 - k.j0) * g.info.frame.step_j()}},
          {"bottom", p.bottom},
          {"top", std::isfinite(p.top) ? Json(p.top) : Json(nullptr)}};
}

void print_text(const Database& db, const Extraction& x, const Options& o) {
  fmt::print("{} patches at error {:g} m: bounds {:.4g} to {:.4g} m\n", x.patches.size(), o.error,
             x.error_available, x.bound_max);
  fmt::print("  by level {}\n  by grid {}\n", by_level(x).dump(), by_grid(db, x).dump());
  fmt::print("  cost: {} pages and {} boxes of the R-tree, {:.2f} MB of samples, {:.3f} ms\n", x.cost.nodes,
             x.cost.boxes, double(x.cost.bytes) / 1e6, 1000 * x.cost.seconds);
  if (!o.list) return;
  fmt::print("{:<20} {:>5} {:>9} {:>14} {:>14} {:>9} {:>9}\n", "grid", "level", "block", "x", "y", "bottom",
             "top");
  for (const PatchId id : x.patches) {
    const Json j = json_of(db, id);
    fmt::print("{:<20} {:>5} {:>9} {:>14.2f} {:>14.2f} {:>9.4g} {:>9.4g}\n", j["grid"].get<std::string>(),
               id.level(), fmt::format("{},{}", id.bx(), id.by()), j["centre"][0].get<double>(),
               j["centre"][1].get<double>(), db.patch(id).bottom, db.patch(id).top);
  }
}

void run(const Options& o, const Common& common) {
  const Database db = Database::open(o.database, common.memory);
  const Extraction x = extract(db, {o.error, o.region.region(), o.strict});
  if (!common.json) return print_text(db, x, o);
  Json j{{"patches", x.patches.size()},
         {"by_level", by_level(x)},
         {"by_grid", by_grid(db, x)},
         {"bound_max", x.bound_max},
         {"error_available", x.error_available}};
  j["cost"] = {{"nodes", x.cost.nodes},
               {"boxes", x.cost.boxes},
               {"patches", x.cost.patches},
               {"bytes", x.cost.bytes},
               {"seconds", x.cost.seconds}};
  if (o.list)
    for (const PatchId id : x.patches) j["list"].push_back(json_of(db, id));
  print(j);
}

}  // namespace

void add_query(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "query", "the patches that an error needs, and what finding them costs");
  v->add_option("DB", o->database, "the database")->required();
  v->add_option("--error", o->error, "largest error that you accept, metres; 0 means the best there is")
      ->required();
  o->region.add_to(*v, true);
  v->add_flag("--strict", o->strict, "only patches of that error, not the best where it is not available");
  v->add_flag("--list", o->list, "every patch, in the order in which they speak");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
