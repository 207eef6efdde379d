// patchwork profile: heights along a line over the ground.
#include "blend/profile.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/cli.h"
#include "tools/resampler.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database, line;
  double step = 0;
  SurfaceOptions surface;
};

Extent bounds_of(const std::vector<Point>& points) {
  Extent e = Extent::nothing();
  for (const Point& p : points) e.add(p);
  return e;
}

Json summary(const Profile& p) {
  return {{"length", p.length}, {"missing", p.missing}, {"lowest", p.lowest},      {"highest", p.highest},
          {"ascent", p.ascent}, {"descent", p.descent}, {"bound_max", p.bound_max}};
}

void run(const Options& o, const Common& common) {
  const Database db = Database::open(o.database, common.memory);
  const std::vector<Point> line = parse_points("line", o.line);
  const Extent around = bounds_of(line);
  const Extraction x =
      extract(db, {.error = o.surface.error, .region = Region::inside(around), .strict = o.surface.strict});
  const auto surface = make_evaluator(db, x.patches, o.surface, common.memory);
  const Profile p = profile_along(*surface, line, o.step > 0 ? o.step : finest_step(db, around));
  if (common.json) {
    Json j = summary(p);
    j["points"] = Json::array();
    for (const ProfilePoint& q : p.points)
      j["points"].push_back({q.distance, q.at.x, q.at.y, q.height, q.bound, source_name(db, q.source)});
    return print(j);
  }
  for (const ProfilePoint& q : p.points)
    fmt::print("{} {} {} {} {} {}\n", q.distance, q.at.x, q.at.y, q.height, q.bound,
               source_name(db, q.source));
  note(common,
       fmt::format(
           "{:.6g} m, heights {:.2f} to {:.2f} m, up {:.2f} m, down {:.2f} m, bound at most {:.4g} m{}",
           p.length, p.lowest, p.highest, p.ascent, p.descent, p.bound_max,
           p.missing > 0 ? fmt::format(", {:.6g} m without data", p.missing) : ""));
}

}  // namespace

void add_profile(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v =
      verb(app, common, "profile", "heights along a line: lines \"distance x y height bound grid\" out");
  v->add_option("DB", o->database, "the database")->required();
  v->add_option("--line", o->line, "\"x y, x y, ...\" or WKT, in the database's CRS")->required();
  v->add_option("--step", o->step, "between points, metres at most; else the finest step of the grids there")
      ->check(above_zero());
  o->surface.add_to(*v);
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
