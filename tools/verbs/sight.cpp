// patchwork sight: who sees what over the terrain, and where a ray first meets it.
#include "blend/sight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "db/error.h"
#include "tools/cli.h"
#include "tools/number_lines.h"

namespace patchwork::cli {

namespace {

constexpr std::size_t kBatch = 1 << 16;  // rays answered together

struct Options {
  std::string database;
  std::vector<double> from, to;
  double azimuth = 0, elevation = 0, distance = 0;
  bool absolute = false;
  Air air;
  SurfaceOptions surface;
};

// What was asked for: two ends, or an end and a direction; z of an end as it was given.
struct Asked {
  Point3 from, to;
  bool directed = false;
};

std::vector<Asked> read_lines(std::istream& in) {
  NumberLines lines(in, {{"x1", "x", "easting"},
                         {"y1", "y", "northing"},
                         {"h1", "h", "height"},
                         {"x2", "x", "easting"},
                         {"y2", "y", "northing"},
                         {"h2", "h", "height"}});
  std::vector<Asked> all;
  for (double n[6]; lines.next(n);) all.push_back({{n[0], n[1], n[2]}, {n[3], n[4], n[5]}});
  return all;
}

std::vector<Asked> asked(const Options& o) {
  if (o.from.empty()) return read_lines(std::cin);
  Asked a{.from = {o.from[0], o.from[1], o.from[2]}, .to = {}, .directed = o.to.empty()};
  if (a.directed)
    a.to = directed_ray(a.from, o.azimuth, o.elevation, o.distance, o.air).to;
  else
    a.to = {o.to[0], o.to[1], o.to[2]};
  return {a};
}

Extent bounds_of(const std::vector<Asked>& all) {
  Extent e = Extent::nothing();
  for (const Asked& a : all)
    for (const Point3& p : {a.from, a.to}) {
      if (!std::isfinite(p.x + p.y + p.z)) throw Error("sight", "an end is not finite");
      e.add(Point{p.x, p.y});
    }
  return e;
}

// Heights above the ground become heights of the database.
void raise(std::vector<Asked>& all, const Evaluator& surface) {
  std::vector<double> x, y;
  for (const Asked& a : all) x.insert(x.end(), {a.from.x, a.to.x}), y.insert(y.end(), {a.from.y, a.to.y});
  std::vector<double> ground(x.size());
  surface.at_points(x, y, {.height = ground, .bound = {}, .source = {}, .patch = {}});
  for (std::size_t k = 0; k < all.size(); ++k) {
    const double from = ground[2 * k], to = all[k].directed ? from : ground[2 * k + 1];
    if (std::isnan(from + to))
      throw Error(fmt::format("ray {}", k + 1), "there is no ground under an end",
                  "give heights with --absolute");
    all[k].from.z += from, all[k].to.z += to;
  }
}

constexpr const char* kVerdicts[] = {"visible", "hidden", "undecided"};
const char* verdict_of(const Sight& s) { return kVerdicts[int(s.verdict)]; }

Json json_of(const Point3& p) { return {p.x, p.y, p.z}; }
Json json_of(const Asked& a, const Sight& s) {
  Json j{
      {"from", json_of(a.from)}, {"to", json_of(a.to)}, {"visible", !s.blocked}, {"verdict", verdict_of(s)}};
  j["clearance"] = std::isfinite(s.clearance) ? Json(s.clearance) : Json(nullptr);
  j["nearest"] =
      std::isfinite(s.clearance)
          ? Json{{"at", json_of(s.nearest)}, {"distance", s.nearest_distance}, {"bound", s.nearest_bound}}
          : Json(nullptr);
  j["hit"] = s.blocked ? Json{{"at", json_of(s.hit)}, {"distance", s.hit_distance}, {"bound", s.hit_bound}}
                       : Json(nullptr);
  return j;
}

void print_one(const Sight& s) {
  if (s.verdict == Verdict::undecided)
    fmt::print("{}, but the terrain's bounds leave it undecided\n", s.blocked ? "hidden" : "visible");
  else
    fmt::print("{}, whatever the terrain is within its bounds\n", verdict_of(s));
  if (std::isfinite(s.clearance))
    fmt::print(
        "  least clearance {:.3f} m (bound {:.4g} m), {:.2f} m from the eye, over {:.2f} {:.2f} at {:.3f} "
        "m\n",
        s.clearance, s.nearest_bound, s.nearest_distance, s.nearest.x, s.nearest.y, s.nearest.z);
  if (s.blocked)
    fmt::print("  first meets the terrain {:.3f} m from the eye, at {:.3f} {:.3f} {:.3f} (bound {:.4g} m)\n",
               s.hit_distance, s.hit.x, s.hit.y, s.hit.z, s.hit_bound);
}

void print_line(const Sight& s) {
  fmt::print("{} {} {} {} {}\n", s.blocked ? "hidden" : "visible", verdict_of(s), s.clearance,
             s.nearest_distance, s.hit_distance);
}

void run(const Options& o, const Common& common) {
  if (o.from.empty() != (o.to.empty() && o.distance == 0))
    throw CLI::ValidationError("--from", "it goes with --to, or with --distance");
  const Database db = Database::open(o.database, common.memory);
  std::vector<Asked> rays = asked(o);
  Json all = Json::array();
  if (!rays.empty()) {
    const Extraction x = extract(db, {.error = o.surface.error, .region = Region::inside(bounds_of(rays))});
    const SightLines lines(db, x.patches, o.surface.blend_options());
    if (!o.absolute) raise(rays, lines.surface());
    for (std::size_t from = 0; from < rays.size(); from += kBatch) {
      std::vector<SightRay> some;
      for (std::size_t k = from; k < std::min(rays.size(), from + kBatch); ++k)
        some.push_back({rays[k].from, rays[k].to});
      const std::vector<Sight> found = lines.find(some, o.air);
      for (std::size_t k = 0; k < found.size(); ++k) {
        if (common.json)
          all.push_back(json_of(rays[from + k], found[k]));
        else
          o.from.empty() ? print_line(found[k]) : print_one(found[k]);
      }
    }
  }
  if (common.json) print({{"rays", all}});
}

}  // namespace

void add_sight(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v =
      verb(app, common, "sight",
           "lines of sight: what hides them, and where a ray first meets the terrain; without --from, lines "
           "\"x y h x y h\" (or a table with columns x1 y1 h1 x2 y2 h2) in, \"visible|hidden verdict "
           "clearance its-distance hit-distance\" out");
  v->add_option("DB", o->database, "the database")->required();
  auto* from = v->add_option("--from", o->from, "the eye: x y h, h in metres above the ground")->expected(3);
  auto* to = v->add_option("--to", o->to, "what it looks at: x y h")->expected(3)->needs(from);
  auto* distance = v->add_option("--distance", o->distance, "of a ray, metres along the ground")
                       ->check(above_zero())
                       ->needs(from)
                       ->excludes(to);
  v->add_option("--azimuth", o->azimuth, "of a ray, degrees clockwise from the y axis")
      ->check(finite())
      ->needs(distance);
  v->add_option("--elevation", o->elevation, "of a ray, degrees above the horizontal")
      ->check(CLI::Range(-89.9, 89.9))
      ->needs(distance);
  v->add_flag("--absolute", o->absolute, "h are heights as the database has them, not above the ground");
  v->add_flag_callback(
      "--flat", [o] { o->air.curved = false; }, "without the earth's curvature");
  v->add_option("--refraction", o->air.refraction, "curvature of light over the earth's")
      ->check(finite())
      ->capture_default_str();
  v->add_option("--radius", o->air.radius, "of the earth, metres")
      ->check(above_zero())
      ->capture_default_str();
  o->surface.add_blend_to(*v);
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
