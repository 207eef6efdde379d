// patchwork accuracy: how accurate the terrain is over an area, where it is best and worst, which grids
// answer.
#include "blend/accuracy.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "tools/cli.h"
#include "tools/output_file.h"
#include "tools/resampler.h"
#include "tools/surface_dataset.h"

namespace patchwork::cli {

namespace {

constexpr double kMostPixels = 4e6;  // where no step is asked for

struct Options {
  std::string database, map;
  double step = 0;
  SurfaceOptions surface;
  RegionOptions region;
};

// The finest step of the grids there, or what keeps the raster small enough.
double step_of(const Database& db, const Extent& e, double asked) {
  if (asked > 0) return asked;
  return std::max(finest_step(db, e), std::sqrt((e.xmax - e.xmin) * (e.ymax - e.ymin) / kMostPixels));
}

// Without data outside the area.
void write_map(const Evaluator& surface, const Database& db, const Raster& r, const Area& area,
               const Options& o, const Common& common) {
  SurfaceRaster d{.width = r.width, .height = r.height, .crs_wkt = db.crs()};
  d.geotransform = {r.xmin, r.step, 0, r.ymax, 0, -r.step};
  d.bands = {{.name = "bound", .unit = "m"}};
  ProgressBar bar(common, "accuracy", double(r.width) * r.height / 1e6, "Mpx");
  Resampler resampler(surface, r, {"bound"}, common.memory, [&](double share) { bar.show(share); });
  write_cog(
      o.map, d,
      [&](int factor, int row, int rows, std::span<float* const> bands) {
        resampler.rows(factor, row, rows, bands);
        if (!area.inside) return;
        const RasterFrame f = r.frame(factor);
        const int width = (r.width + factor - 1) / factor;
        for (int y = 0; y < rows; ++y)
          for (int x = 0; x < width; ++x)
            if (!area.inside(f.at(x, row + y)))
              bands[0][std::size_t(y) * std::size_t(width) + std::size_t(x)] = NAN;
      },
      [](double) {});
}

Json json_of(const Accuracy::Place& p) {
  if (std::isnan(p.bound)) return nullptr;
  return {{"bound", p.bound}, {"at", {p.at.x, p.at.y}}};
}

Json json_of(const Accuracy& a, const Database& db, double step) {
  Json j{{"best", json_of(a.best)},
         {"worst", json_of(a.worst)},
         {"mean", a.mean},
         {"median", a.median},
         {"p95", a.p95},
         {"area", a.answered},
         {"area_missing", a.missing},
         {"area_filled", a.filled},
         {"step", step}};
  j["by_grid"] = Json::object();
  for (std::size_t g = 0; g < a.by_source.size(); ++g)
    if (a.by_source[g] > 0) j["by_grid"][db.grids()[g].info.name] = a.by_source[g];
  return j;
}

void print_text(const Accuracy& a, const Database& db) {
  if (a.answered == 0) return fmt::print("no data there\n");
  fmt::print("smallest error available {:.4g} m, at {:.2f} {:.2f}\n", a.best.bound, a.best.at.x, a.best.at.y);
  fmt::print("largest bound {:.4g} m, at {:.2f} {:.2f}\n", a.worst.bound, a.worst.at.x, a.worst.at.y);
  fmt::print("bounds: mean {:.4g} m, half the area {:.4g} m or less, 95 % {:.4g} m or less\n", a.mean,
             a.median, a.p95);
  fmt::print("{:.6g} m2 with data, {:.6g} m2 without, {:.6g} m2 from filled cells alone\n", a.answered,
             a.missing, a.filled);
  for (std::size_t g = 0; g < a.by_source.size(); ++g)
    if (a.by_source[g] > 0)
      fmt::print("  {:<20} {:5.1f} %\n", db.grids()[g].info.name, 100 * a.by_source[g] / a.answered);
}

void run(const Options& o, const Common& common) {
  const Database db = open_filled(o.database, common);
  refuse_overwriting(o.database, {o.map});
  const Region region = o.region.region();
  const bool whole = !o.region.given();
  const Extent extent = whole ? db.extent() : region.bounds();
  const Raster raster = Raster::covering(extent, step_of(db, extent, o.step));
  const Extraction x = extract(
      db, {.error = o.surface.error, .region = Region::inside(raster.extent()), .strict = o.surface.strict});
  const auto surface = make_evaluator(db, x.patches, o.surface, common.memory);
  Area area{.frame = raster.frame(), .width = raster.width, .height = raster.height};
  if (!whole) area.inside = [&](Point p) { return region.contains(p); };
  std::optional<ProgressBar> bar;
  bar.emplace(common, "accuracy", 1e-6 * double(raster.width) * raster.height, "Mpx");
  area.progress = [&](double share) { bar->show(share); };
  const Accuracy a = accuracy_over(*surface, area, db.grids().size());
  bar.reset();
  if (!o.map.empty()) write_map(*surface, db, raster, area, o, common);
  common.json ? print(json_of(a, db, raster.step)) : print_text(a, db);
}

}  // namespace

void add_accuracy(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v =
      verb(app, common, "accuracy",
           "how accurate the terrain is over an area: the smallest error available and where, which "
           "grids answer, a map of bounds");
  v->add_option("DB", o->database, "the database")->required();
  o->region.add_to(*v, true);
  o->surface.add_to(*v);
  v->add_option(
       "--step", o->step,
       "between the points that are looked at, metres; else the grids' finest step, or what makes four "
       "million points")
      ->check(above_zero());
  v->add_option("--map", o->map, "also writes the bounds as a GeoTIFF");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
