// patchwork volume: area and volume between surveys, or over a plane, with what their bounds leave open.
#include "blend/volume.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "db/error.h"
#include "tools/cli.h"
#include "tools/resampler.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database;
  std::vector<std::string> before, after;
  std::optional<double> plane;
  double step = 0;
  int smoothness = 0;
  RegionOptions region;
};

std::vector<GridId> ids_of(const Database& db, const std::vector<std::string>& names) {
  std::vector<GridId> ids;
  for (const std::string& name : names) {
    const std::size_t known = ids.size();
    for (const Grid& g : db.grids())
      if (g.info.name == name) ids.push_back(g.info.id);
    if (ids.size() == known) throw Error(name, "no grid of this name", "see them with: patchwork list");
  }
  return ids;
}

Extent bounds_of(const Database& db, const std::vector<GridId>& ids) {
  Extent e = Extent::nothing();
  for (const GridId id : ids) {
    const GridInfo& g = db.grid(id).info;
    e.add(g.frame.bounds(g.shape.samples()));
  }
  return e;
}

// The surface of the named surveys alone, or the best that the whole database has.
class Surface {
 public:
  Surface(const Database& db, const std::vector<std::string>& names, const Extent& extent, int smoothness)
      : blend_(db, patches(db, names, Region::inside(extent)), {.smoothness = smoothness}) {}
  const Blend& blend() const { return blend_; }

 private:
  static std::vector<PatchId> patches(const Database& db, const std::vector<std::string>& names,
                                      const Region& region) {
    if (names.empty()) return extract(db, {.error = 0, .region = region}).patches;
    return extract_grids(db, ids_of(db, names), region).patches;
  }
  Blend blend_;
};

// What the two have in common, where no region is asked for.
Extent extent_of(const Database& db, const Options& o) {
  if (o.region.given()) return o.region.region().bounds();
  Extent e = db.extent();
  for (const auto* names : {&o.before, &o.after})
    if (!names->empty()) e = e.common(bounds_of(db, ids_of(db, *names)));
  if (!(e.xmin < e.xmax && e.ymin < e.ymax)) throw Error("surveys", "they have no area in common");
  return e;
}

Json json_of(const VolumePart& p) {
  return {{"area", p.area}, {"volume", p.volume}, {"least", p.least}, {"most", p.most}};
}

void print_part(const char* name, const VolumePart& p) {
  fmt::print("  {:<6} {:.6g} m3 on {:.6g} m2; at least {:.6g} and at most {:.6g} m3\n", name, p.volume,
             p.area, p.least, p.most);
}

void run(const Options& o, const Common& common) {
  if (o.before.empty() != o.plane.has_value())
    throw CLI::ValidationError("--before", "name surveys to compare with, or a --plane");
  const Database db = open_filled(o.database, common);
  const Extent extent = extent_of(db, o);
  // Pixels as fine as what is compared, whatever else lies there.
  std::vector<GridId> compared = ids_of(db, o.after);
  if (!compared.empty() && !o.plane) {
    const std::vector<GridId> before = ids_of(db, o.before);
    compared.insert(compared.end(), before.begin(), before.end());
  }
  const double step = o.step > 0 ? o.step : finest_step(db, extent, compared);
  const Surface after(db, o.after, extent, o.smoothness);
  std::optional<Surface> before;
  if (!o.plane) before.emplace(db, o.before, extent, o.smoothness);
  const Region region = o.region.region();
  const Raster pixels = Raster::covering(extent, step);
  std::optional<ProgressBar> bar;
  bar.emplace(common, "volume", 1.25e-6 * double(pixels.width) * pixels.height, "Mpx");
  const auto measure = [&](double at_step, double done, double part) {
    const Raster r = Raster::covering(extent, at_step);
    Area area{.frame = r.frame(), .width = r.width, .height = r.height};
    area.progress = [&, done, part](double share) { bar->show(done + part * share); };
    area.inside = [&](Point p) { return extent.contains(p) && region.contains(p); };
    return before ? volume_between(after.blend(), before->blend(), area)
                  : volume_over_plane(after.blend(), *o.plane, area);
  };
  const Volume v = measure(step, 0, 0.8);
  const double coarser = std::abs(measure(2 * step, 0.8, 0.2).net() - v.net());
  bar.reset();
  if (common.json)
    return print({{"net", v.net()},
                  {"error", v.error},
                  {"fill", json_of(v.above)},
                  {"cut", json_of(v.below)},
                  {"area", v.area},
                  {"area_missing", v.missing},
                  {"area_undecided", v.undecided},
                  {"step", step},
                  {"twice_the_step_differs_by", coarser}});
  fmt::print("net {:.6g} m3, right to {:.4g} m3 by the bounds, over {:.6g} m2\n", v.net(), v.error, v.area);
  print_part("fill", v.above), print_part("cut", v.below);
  if (v.undecided > 0) fmt::print("  on {:.6g} m2 the bounds do not tell which is the higher\n", v.undecided);
  if (v.missing > 0) fmt::print("  {:.6g} m2 have no data in one of them\n", v.missing);
  fmt::print("  summed over pixels of {:g} m; pixels of {:g} m give {:.4g} m3 more or less\n", step, 2 * step,
             coarser);
}

}  // namespace

void add_volume(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v =
      verb(app, common, "volume",
           "area and volume between surveys, or over a plane, with the error that their bounds imply");
  v->add_option("DB", o->database, "the database")->required();
  auto* before = v->add_option("--before", o->before, "surveys by name: the lower surface")->delimiter(',');
  v->add_option("--after", o->after, "surveys by name: the upper surface; else the best of all there are")
      ->delimiter(',');
  v->add_option("--plane", o->plane, "instead of --before: a level plane at this height, metres")
      ->check(finite())
      ->excludes(before);
  o->region.add_to(*v, true);
  v->add_option("--step", o->step, "of the pixels that are summed, metres; else the grids' finest step")
      ->check(above_zero());
  v->add_option("--smoothness", o->smoothness, "k: derivatives that are continuous")
      ->check(CLI::Range(0, 2))
      ->capture_default_str();
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
