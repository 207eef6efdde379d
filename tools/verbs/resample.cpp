// patchwork resample: the surface as a Cloud Optimized GeoTIFF, and pictures of it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "db/stopwatch.h"
#include "render/hillshade.h"
#include "render/patch_map.h"
#include "tools/cli.h"
#include "tools/output_file.h"
#include "tools/resampler.h"
#include "tools/surface_dataset.h"

namespace patchwork::cli {

namespace {

constexpr double kEvaluating =
    0.8;  // about this part of the time, where all is evaluated before it is written
constexpr double kPictureSide = 1200;  // pixels of the longer side that pictures are made from

struct Options {
  std::string database, out, hillshade, map, compression = "NONE";
  double step = 0;
  std::vector<std::string> bands{"height"};
  SurfaceOptions surface;
  RegionOptions region;
};

SurfaceRaster describe(const Database& db, const Raster& r, const Options& o) {
  SurfaceRaster d{.width = r.width, .height = r.height, .crs_wkt = db.crs(), .compression = o.compression};
  d.geotransform = {r.xmin, r.step, 0, r.ymax, 0, -r.step};
  d.metadata = {{"PATCHWORK_ERROR", fmt::format("{}", o.surface.error)},
                {"PATCHWORK_SMOOTHNESS", std::to_string(o.surface.smoothness)},
                {"PATCHWORK_BLEND", o.surface.blend},
                {"PATCHWORK_CONTENT", db.content_hash()}};
  for (const std::string& b : o.bands) {
    SurfaceBand band{.name = b, .unit = b == "source" ? "" : "m"};
    if (b == "source")
      for (std::size_t g = 0; g < db.grids().size(); ++g)
        band.metadata.emplace_back(fmt::format("SOURCE_{}", g + 1), db.grids()[g].info.name);
    d.bands.push_back(std::move(band));
  }
  return d;
}

Raster picture_raster(const Raster& full) {
  const double coarser = std::max(1.0, std::max(full.width, full.height) / kPictureSide);
  return Raster::covering(
      {full.xmin, full.ymax - full.height * full.step, full.xmin + full.width * full.step, full.ymax},
      full.step * coarser);
}

std::string title(const Options& o, const Extraction& x) {
  const std::string error =
      o.surface.error > 0 ? fmt::format("error {:g} m", o.surface.error) : "best available";
  return fmt::format("{}, {} patches, k = {}, {} blend", error, x.patches.size(), o.surface.smoothness,
                     o.surface.blend);
}

void draw_hillshade(const Evaluator& blend, const Raster& r, const Options& o, const Extraction& x) {
  std::vector<double> height(size_t(r.width) * size_t(r.height));
  blend.at_pixels(r.frame(), r.width, 0, r.height,
                  {.height = height, .bound = {}, .source = {}, .patch = {}});
  const std::vector<float> shade(height.begin(), height.end());
  write_picture(o.hillshade, hillshade(shade, r.width, r.height, r.step, title(o, x)));
}

// The middle of a kernel's two sides, metres: what the map shows as the size of a patch.
double kernel_size(const Grid& g, PatchId id) {
  return std::ldexp(kKernelCells * std::sqrt(g.info.frame.cell_area()), id.level());
}

Corners outline(const Database& db, PatchId id, const Raster& r) {
  const GridInfo& g = db.grid(id.grid()).info;
  Corners corners = g.frame.corners(g.shape.kernel(id.level(), id.bx(), id.by()));
  for (Point& p : corners) p = {(p.x - r.xmin) / r.step, (r.ymax - p.y) / r.step};
  return corners;
}

void draw_map(const Database& db, const Blend& blend, const Raster& r, const Options& o,
              const Extraction& x) {
  const std::size_t n = size_t(r.width) * size_t(r.height);
  std::vector<std::int32_t> patch(n), source(n);
  blend.at_pixels(r.frame(), r.width, 0, r.height,
                  {.height = {}, .bound = {}, .source = source, .patch = patch});
  std::vector<float> size(n, NAN);
  std::vector<std::uint16_t> grid(n, 0);
  std::vector<std::uint8_t> filled(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    if (patch[k] < 0) continue;
    const PatchId id = x.patches[size_t(patch[k])];
    size[k] = float(kernel_size(db.grid(id.grid()), id));
    grid[k] = std::uint16_t(std::abs(source[k]) - 1), filled[k] = source[k] < 0;
  }
  PatchMapInput input{.width = r.width,
                      .height = r.height,
                      .kernel_metres = size,
                      .grid = grid,
                      .filled = filled,
                      .grid_names = {},
                      .outlines = {},
                      .title = title(o, x),
                      .step_metres = r.step};
  for (const Grid& g : db.grids()) input.grid_names.push_back(g.info.name);
  for (const PatchId id : x.patches) input.outlines.push_back(outline(db, id, r));
  write_picture(o.map, patch_map(input));
}

// An extent is rounded outward by a hair; a raster whose pixels are to meet a grid's samples must not be.
Extent to_micrometres(const Extent& e) {
  const auto round = [](double v) { return std::nearbyint(v * 1e6) / 1e6; };
  return {round(e.xmin), round(e.ymin), round(e.xmax), round(e.ymax)};
}

void run(const Options& o, const Common& common) {
  const Stopwatch watch;
  const Database db = open_filled(o.database, common);
  refuse_overwriting(o.database, {o.out, o.hillshade, o.map});
  const Extent extent = o.region.extent.empty() ? to_micrometres(db.extent()) : o.region.region().bounds();
  const Raster raster = Raster::covering(extent, o.step > 0 ? o.step : finest_step(db, extent));
  const double open_seconds = watch.seconds();
  const Extraction x = extract(
      db, {.error = o.surface.error, .region = Region::inside(raster.extent()), .strict = o.surface.strict});
  const double fetch_seconds = prefetch(db, x.patches, common.memory);
  const std::unique_ptr<Evaluator> blend = make_evaluator(db, x.patches, o.surface, common.memory);
  const Stopwatch writing;
  std::optional<ProgressBar> bar;
  bar.emplace(common, "resample", double(raster.width) * raster.height / 1e6, "Mpx");
  Resampler resampler(*blend, raster, o.bands, common.memory,
                      [&](double share) { bar->show(kEvaluating * share); });
  const double before = resampler.whole() ? kEvaluating : 0;
  write_cog(
      o.out, describe(db, raster, o),
      [&](int factor, int row, int rows, std::span<float* const> bands) {
        resampler.rows(factor, row, rows, bands);
      },
      [&](double share) { bar->show(before + (1 - before) * share); });
  bar.reset();
  const double write_seconds = writing.seconds() - resampler.tally().blend_seconds;
  const Stopwatch drawing;
  const Raster small = picture_raster(raster);
  if (!o.hillshade.empty()) draw_hillshade(*blend, small, o, x);
  if (!o.map.empty()) draw_map(db, Blend(db, x.patches, o.surface.blend_options()), small, o, x);
  const BlendCounts& c = resampler.tally().full;
  const double seconds = watch.seconds();
  if (common.json) {
    Json j{{"seconds", seconds},       {"samples", c.points},           {"patches", x.patches.size()},
           {"bound_max", c.bound_max}, {"contributors_mean", c.mean()}, {"contributors_max", c.most},
           {"width", raster.width},    {"height", raster.height},       {"engine", engine_name(*blend)}};
    j["stages"] = {{"open", open_seconds},   {"query", x.cost.seconds},
                   {"fetch", fetch_seconds}, {"blend", resampler.tally().blend_seconds},
                   {"write", write_seconds}, {"pictures", drawing.seconds()}};
    print(j);
  } else if (!common.quiet) {
    fmt::print(
        "{}: {} x {} pixels of {:g} m from {} patches ({:.2f} a pixel, {} at most), bound at most {:.4g} m, "
        "{:.2f} s\n",
        o.out, raster.width, raster.height, raster.step, x.patches.size(), c.mean(), c.most, c.bound_max,
        seconds);
  }
}

}  // namespace

void add_resample(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "resample", "the surface as a Cloud Optimized GeoTIFF");
  v->add_option("DB", o->database, "the database")->required();
  v->add_option("OUT", o->out, "the GeoTIFF to write")->required();
  o->surface.add_to(*v);
  o->region.add_to(*v, false);
  v->add_option("--step", o->step, "of a pixel, metres; else the finest step of the grids there")
      ->check(above_zero());
  v->add_option("--bands", o->bands, "height,bound,source (source: grid number, negative where filled)")
      ->delimiter(',')
      ->check(CLI::IsMember({"height", "bound", "source"}))
      ->capture_default_str();
  v->add_option("--compress", o->compression, "of the GeoTIFF")
      ->check(CLI::IsMember({"NONE", "DEFLATE", "ZSTD", "LERC"}))
      ->capture_default_str();
  v->add_option("--hillshade", o->hillshade, "also draws a shaded relief (PNG)");
  v->add_option("--map", o->map, "also draws which patch and which grid answers where (PNG)");
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
