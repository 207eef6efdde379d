// patchwork query: the extraction itself, and what it cost.
#include <fmt/format.h>

#include <optional>

#include "tools/cli.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database;
  std::optional<double> error;
  bool strict = false, list = false;
  RegionOptions region;
  std::vector<double> eye, look, size{1280, 720};
  double fov = 60, pixel_error = 1;
  std::size_t patches = 0;  // the budget; 0: none
};

// What was asked for, in the unit of the cut: metres of a uniform cut, pixels of a view.
struct Asked {
  Extraction extraction;
  double error = 0;
  const char* unit = "m";
};

ViewCut view_of(const Database& db, const Options& o) {
  return over_terrain_of(db, {.eye = {o.eye[0], o.eye[1], o.eye[2]},
                              .look = {o.look[0], o.look[1], o.look[2]},
                              .fov_degrees = o.fov,
                              .width = int(o.size[0]),
                              .height = int(o.size[1]),
                              .pixel_error = o.pixel_error,
                              .strict = o.strict});
}

Asked ask(const Database& db, const Options& o) {
  const bool view = !o.eye.empty();
  if (view && (o.error || !o.region.extent.empty() || !o.region.polygon.empty()))
    throw CLI::ValidationError("--eye", "a view brings its own error and region");
  if (!view && !o.error && o.patches == 0)
    throw CLI::RequiredError("--error, --eye with --look, or --patches");
  ViewCut v = view ? view_of(db, o) : ViewCut{};
  UniformCut u{o.error.value_or(0), o.region.region(), o.strict};
  if (o.patches == 0)
    return {view ? extract(db, v) : extract(db, u), view ? v.pixel_error : u.error, view ? "px" : "m"};
  double most = view ? 4096 : 1;
  for (const Grid& g : db.grids())
    if (!view) most = std::max(most, 2 * g.patches[g.patches.size() - 1].bottom);
  const Budgeted b = extract_within(db, {.patches = o.patches}, most, [&](double error) {
    v.pixel_error = u.error = error;
    return view ? make_surface(v) : make_surface(u);
  });
  return {b.extraction, b.error, view ? "px" : "m"};
}

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

void print_text(const Database& db, const Asked& asked, const Options& o) {
  const Extraction& x = asked.extraction;
  fmt::print("{} patches at error {:g} {}: bounds {:.4g} to {:.4g} m\n", x.patches.size(), asked.error,
             asked.unit, x.error_available, x.bound_max);
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
  const Asked asked = ask(db, o);
  const Extraction& x = asked.extraction;
  if (!common.json) return print_text(db, asked, o);
  Json j{{"patches", x.patches.size()},
         {"error", asked.error},
         {"unit", asked.unit},
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
  v->add_option("--error", o->error, "largest error that you accept, metres; 0 means the best there is");
  auto* eye = v->add_option("--eye", o->eye, "where a view is seen from: x y z, metres")->expected(3);
  v->add_option("--look", o->look, "the point in the middle of the view: x y z")->expected(3)->needs(eye);
  eye->needs("--look");
  v->add_option("--fov", o->fov, "vertical field of view, degrees");
  v->add_option("--size", o->size, "of the view: width height, pixels")->expected(2);
  v->add_option("--pixel-error", o->pixel_error, "largest error that you accept on the screen, pixels");
  v->add_option("--patches", o->patches, "a budget: the smallest error that needs no more patches");
  o->region.add_to(*v, true);
  v->add_flag("--strict", o->strict, "only patches of that error, not the best where it is not available");
  v->add_flag("--list", o->list, "every patch, in the order in which they speak");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
