// patchwork query: the extraction itself, and what it cost.
#include <fmt/format.h>

#include <optional>

#include "db/raster.h"
#include "query/cost_model.h"
#include "tools/cli.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database;
  std::optional<double> error;
  bool strict = false, list = false;
  RegionOptions region;
  std::vector<double> eye, look;
  std::vector<int> size{1280, 720};
  double fov = 60, pixel_error = 1;
  std::size_t patches = 0, bytes = 0;  // budgets; 0: none
  double milliseconds = 0;
  bool cone = false;
  std::string field, corridor;
  std::optional<double> outside;
  double width = 0, ramp = 0;
  bool explain = false;
  bool budgeted() const { return patches > 0 || bytes > 0 || milliseconds > 0; }
};

// What was asked for, in the unit of the cut: metres of a uniform cut, pixels of a view.
struct Asked {
  Extraction extraction;
  double error = 0;
  const char* unit = "m";
  bool kept = true;  // the budget
};

ViewCut view_of(const Database& db, const Options& o) {
  return over_terrain_of(db, {.eye = {o.eye[0], o.eye[1], o.eye[2]},
                              .look = {o.look[0], o.look[1], o.look[2]},
                              .fov_degrees = o.fov,
                              .width = o.size[0],
                              .height = o.size[1],
                              .pixel_error = o.pixel_error,
                              .in_space = o.cone,
                              .strict = o.strict});
}

// The file's values are metres of tolerance.
FieldCut field_of(const Database& db, const Options& o, const Common& common) {
  const RasterSource file = RasterSource::open(o.field, {.accuracy = 0}, db.crs());
  for (const std::string& w : file.warnings()) note(common, o.field + ": " + w);
  FieldCut cut{.frame = file.frame(),
               .width = file.width(),
               .height = file.height(),
               .tolerance = {},
               .outside = o.outside.value_or(0),
               .region = o.region.region(),
               .strict = o.strict};
  std::vector<double> row(std::size_t(cut.width));
  for (int j = 0; j < cut.height; ++j) {
    file.read_rows(j, 1, row);
    for (const double raw : row) cut.tolerance.push_back(float(raw * file.scale() + file.offset()));
  }
  return cut;
}

CorridorCut corridor_of(const Options& o) {
  return {.line = parse_points("corridor", o.corridor),
          .error = *o.error,
          .outside = *o.outside,
          .width = o.width,
          .ramp = o.ramp,
          .region = o.region.region(),
          .strict = o.strict};
}

// How an error (metres, or pixels of a view) becomes a cut, and which error is asked for.
struct Question {
  std::function<std::unique_ptr<CutSurface>(double error)> cut_at;
  double error = 0, most = 1;
  const char* unit = "m";
};

Question question(const Database& db, const Options& o, const Common& common) {
  const bool view = !o.eye.empty();
  if (view && (o.error || o.region.given()))
    throw CLI::ValidationError("--eye", "a view brings its own error and region");
  if (!o.field.empty() && (view || o.error || o.budgeted()))
    throw CLI::ValidationError("--field", "a field brings its own error, and has no budget");
  if (!o.corridor.empty() && (view || !o.field.empty() || o.budgeted()))
    throw CLI::ValidationError("--corridor", "it goes with no view, field or budget");
  if (!o.corridor.empty() && (!o.error || !o.outside))
    throw CLI::RequiredError("--corridor: --error within it, and --outside");
  if (o.outside && o.field.empty() && o.corridor.empty())
    throw CLI::RequiredError("--outside: --field or --corridor");
  if (!view && !o.error && o.field.empty() && !o.budgeted())
    throw CLI::RequiredError("--error, --eye with --look, --field, --patches, --bytes or --milliseconds");
  if (o.strict && o.error == 0.) refuse_strict();
  if (!o.field.empty())
    return {[cut = field_of(db, o, common)](double) { return make_surface(cut); }, o.outside.value_or(0),
            o.outside.value_or(0), "m"};
  if (!o.corridor.empty())
    return {[cut = corridor_of(o)](double) { return make_surface(cut); }, *o.error, *o.outside, "m"};
  if (view)
    return {[v = view_of(db, o)](double error) mutable {
              v.pixel_error = error;
              return make_surface(v);
            },
            o.pixel_error, 4096, "px"};
  const double most = std::max(1.0, 2 * db.coarsest_bottom());
  return {[u = UniformCut{0, o.region.region(), o.strict}](double error) mutable {
            u.error = error;
            return make_surface(u);
          },
          o.error.value_or(0), most, "m"};
}

Asked ask(const Database& db, const Options& o, const Question& q) {
  if (!o.budgeted()) return {extract(db, *q.cut_at(q.error), o.strict), q.error, q.unit};
  if (o.milliseconds > 0) {
    const Budgeted b = extract_in_time(db, model_of(db), o.milliseconds / 1000, q.most, q.cut_at);
    return {b.extraction, b.error, q.unit, b.kept};
  }
  const Budget budget{o.patches > 0 ? o.patches : SIZE_MAX, o.bytes > 0 ? o.bytes : SIZE_MAX};
  const Budgeted b = extract_within(db, budget, q.most, q.cut_at);
  return {b.extraction, b.error, q.unit, b.kept};
}

Json json_of(const Cost& c) {
  return {{"nodes", c.nodes},
          {"boxes", c.boxes},
          {"patches", c.patches},
          {"bytes", c.bytes},
          {"seconds", c.seconds}};
}

// What the answer will cost, without the answer. What reading and evaluating cost is known once `patchwork
// cost` has measured it.
void explain(const Database& db, const Question& q, const Common& common) {
  const CostModel model = model_of(db);
  const Cost c = expect(db, *q.cut_at(q.error), model);
  const double read = model.read_seconds(double(c.patches)),
               million = model.blend_seconds(double(c.patches), 1e6);
  if (common.json) {
    Json j{{"error", q.error},
           {"unit", q.unit},
           {"expected", json_of(c)},
           {"model", {{"seconds", model.fixed}, {"page", model.page}, {"patch", model.patch}}}};
    if (model.knows_heights())
      j["expected"].update({{"read_seconds", read}, {"blend_seconds_of_a_million_heights", million}});
    return print(j);
  }
  fmt::print("expected at error {:g} {}: {} patches, {:.2f} MB of samples, {:.3f} ms\n", q.error, q.unit,
             c.patches, double(c.bytes) / 1e6, 1000 * c.seconds);
  fmt::print("  {} pages and {} boxes of the R-tree; {:.3g} us + {:.3g} us a page + {:.3g} us a patch\n",
             c.nodes, c.boxes, 1e6 * model.fixed, 1e6 * model.page, 1e6 * model.patch);
  if (model.knows_heights())
    fmt::print("  then {:.3g} ms to read them from the file, {:.3g} ms for a million heights\n", 1e3 * read,
               1e3 * million);
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
  const std::string where =
      !o.field.empty() ? "at the field's errors"
      : !o.corridor.empty()
          ? fmt::format("at error {:g} m along the corridor, {:g} m outside", asked.error, *o.outside)
          : fmt::format("at error {:g} {}", asked.error, asked.unit);
  fmt::print("{} patches {}: bounds {:.4g} to {:.4g} m", x.patches.size(), where, x.error_available,
             x.bound_inside);
  if (x.bound_max > x.bound_inside)
    fmt::print(", and up to {:.4g} m in half cells beyond a grid's outer samples", x.bound_max);
  fmt::print("\n");
  fmt::print("  by level {}\n  by grid {}\n", by_level(x).dump(), by_grid(db, x).dump());
  fmt::print("  cost: {} pages and {} boxes of the R-tree, {:.2f} MB of samples, {:.3f} ms\n", x.cost.nodes,
             x.cost.boxes, double(x.cost.bytes) / 1e6, 1000 * x.cost.seconds);
  if (!o.list) return;
  fmt::print("{:<20} {:>5} {:>9} {:>14} {:>14} {:>9} {:>9}\n", "grid", "level", "block", "x, m", "y, m",
             "bottom, m", "top, m");
  for (const PatchId id : x.patches) {
    const Json j = json_of(db, id);
    fmt::print("{:<20} {:>5} {:>9} {:>14.2f} {:>14.2f} {:>9.4g} {:>9.4g}\n", j["grid"].get<std::string>(),
               id.level(), fmt::format("{},{}", id.bx(), id.by()), j["centre"][0].get<double>(),
               j["centre"][1].get<double>(), db.patch(id).bottom, db.patch(id).top);
  }
}

void run(const Options& o, const Common& common) {
  const Database db = Database::open(o.database, common.memory);
  const Question q = question(db, o, common);
  if (o.explain) return explain(db, q, common);
  const Asked asked = ask(db, o, q);
  const Extraction& x = asked.extraction;
  if (!asked.kept) note(common, "the budget is too small for any answer there: this is the smallest one");
  if (!common.json) return print_text(db, asked, o);
  Json j{{"patches", x.patches.size()},
         {"error", asked.error},
         {"unit", asked.unit},
         {"by_level", by_level(x)},
         {"by_grid", by_grid(db, x)},
         {"bound_max", x.bound_max},
         {"bound_inside", x.bound_inside},
         {"error_available", x.error_available}};
  if (o.budgeted()) j["within_budget"] = asked.kept;
  j["cost"] = json_of(x.cost);
  if (o.list) {
    j["list"] = Json::array();
    for (const PatchId id : x.patches) j["list"].push_back(json_of(db, id));
  }
  print(j);
}

}  // namespace

void add_query(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "query", "the patches that an error needs, and what finding them costs");
  v->add_option("DB", o->database, "the database")->required();
  auto* error =
      v->add_option("--error", o->error, "largest error that you accept, metres; 0 means the best there is")
          ->check(zero_or_more());
  auto* eye = v->add_option("--eye", o->eye, "where a view is seen from: x y z, metres")->expected(3);
  v->add_option("--look", o->look, "the point in the middle of the view: x y z")->expected(3)->needs(eye);
  eye->needs("--look");
  v->add_option("--fov", o->fov, "vertical field of view, degrees")
      ->needs(eye)
      ->check(CLI::Range(0.001, 179.999))
      ->capture_default_str();
  v->add_option("--size", o->size, "of the view: width height, pixels")
      ->needs(eye)
      ->expected(2)
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  auto* pixels =
      v->add_option("--pixel-error", o->pixel_error, "largest error that you accept on the screen, pixels")
          ->needs(eye)
          ->check(zero_or_more())
          ->capture_default_str();
  v->add_flag("--cone", o->cone, "distances in space, not in the plane: fewer patches for an eye high above")
      ->needs(eye);
  v->add_option("--patches", o->patches, "a budget: the smallest error that needs no more patches")
      ->check(zero_or_more());
  v->add_option("--bytes", o->bytes, "a budget: the smallest error whose samples take no more memory")
      ->check(zero_or_more());
  v->add_option("--milliseconds", o->milliseconds, "a budget: the smallest error that is found in this time")
      ->check(above_zero())
      ->excludes("--patches")
      ->excludes("--bytes");
  v->add_option("--field", o->field, "a raster of errors, metres, that each place may have")
      ->check(CLI::ExistingFile);
  auto* corridor =
      v->add_option("--corridor", o->corridor,
                    "a line that needs --error while the rest may have --outside: \"x y, x y\" or WKT");
  v->add_option("--width", o->width, "of the corridor, metres to either side")
      ->needs(corridor)
      ->check(zero_or_more())
      ->capture_default_str();
  v->add_option("--ramp", o->ramp, "over which the corridor's error becomes that outside, metres")
      ->needs(corridor)
      ->check(zero_or_more())
      ->capture_default_str();
  v->add_option(
       "--outside", o->outside,
       "the error beyond the corridor; or beyond the field and where it has no data (else 0), metres")
      ->check(zero_or_more());
  v->add_flag("--explain", o->explain, "what the answer will cost, and nothing else")
      ->excludes("--patches")
      ->excludes("--bytes")
      ->excludes("--milliseconds");
  o->region.add_to(*v, true);
  auto* strict = v->add_flag("--strict", o->strict,
                             "only patches of that error, not the best where it is not available");
  v->add_flag("--list", o->list, "every patch, in the order in which they speak")->excludes("--explain");
  strict->excludes("--explain");
  for (const char* budget : {"--patches", "--bytes", "--milliseconds"})  // what it finds is the error
    for (CLI::Option* asked : {error, pixels, strict}) asked->excludes(budget);
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
