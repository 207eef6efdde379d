// patchwork render: pictures of the terrain without a window.
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "db/error.h"
#include "db/stopwatch.h"
#include "tools/cli.h"
#include "tools/output_file.h"
#include "tools/scene_setup.h"

namespace patchwork::cli {

namespace {

struct Options {
  std::string database, out, scene, depth, tessellation;
  std::vector<int> size;
  double pixel_error = 0, follow = 0;
  bool stats = false;
};

// DIR/NAME.EXT of frame 7 of a path is DIR/NAME_0007.EXT.
std::string numbered(const std::string& path, int frame) {
  std::filesystem::path p(path);
  p.replace_filename(fmt::format("{}_{:04}{}", p.stem().string(), frame, p.extension().string()));
  return p.string();
}

void write_depth(const std::string& path, const std::vector<float>& metres, int width, int height) {
  GDALAllRegister();
  OutputFile out(path);
  CPLErrorReset();
  GDALDatasetUniquePtr file(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      out.name().c_str(), width, height, 1, GDT_Float32, nullptr));
  if (!file) throw Error(path, "GDAL cannot make it", "check the folder and its permissions");
  GDALRasterBand& band = *file->GetRasterBand(1);
  band.SetNoDataValue(std::numeric_limits<double>::quiet_NaN());
  band.SetDescription("metres along the ray through the pixel's centre");
  const CPLErr error = band.RasterIO(GF_Write, 0, 0, width, height, const_cast<float*>(metres.data()), width,
                                     height, GDT_Float32, 0, 0, nullptr);
  file.reset();  // writes the last blocks
  if (error != CE_None || CPLGetLastErrorType() >= CE_Failure)
    throw Error(path, "it cannot be written in full", "is the disk full?");
  out.publish();
}

// All frames' numbers together.
struct Total {
  int frames = 0;
  std::size_t patches = 0;
  double bound_max = 0, pixels_reached = 0, query = 0, fetch = 0, blend = 0, tessellate = 0, draw = 0,
         write = 0;
  BlendCounts blended;

  void add(const FrameStats& s) {
    ++frames, patches += s.patches_sent;
    bound_max = std::max(bound_max, s.bound_max), pixels_reached = std::max(pixels_reached, s.pixels_reached);
    query += s.select_ms + s.extract_ms, fetch += s.send_ms, blend += s.blend_ms;
    tessellate += s.finish_ms + s.factors_ms, draw += s.draw_ms;
    blended += s.blended;
  }
};

Json facts(const FrameStats& s) {
  return {{"ms",
           {{"select", s.select_ms},
            {"extract", s.extract_ms},
            {"send", s.send_ms},
            {"blend", s.blend_ms},
            {"finish", s.finish_ms},
            {"light", s.light_ms},
            {"factors", s.factors_ms},
            {"draw", s.draw_ms},
            {"total", s.total_ms}}},
          {"patches", s.patches_sent},
          {"tiles_drawn", s.tiles_drawn},
          {"tiles_made", s.tiles_made},
          {"blocks", {{"copied", s.blocks.inside}, {"blended", s.blocks.partial}, {"beside", s.blocks.out}}},
          {"triangles", s.triangles},
          {"front_only", s.front_only},
          {"dispatches", s.dispatches},
          {"draws", s.draws},
          {"bytes_up", s.bytes_up},
          {"pixel_error_asked", s.pixels_asked},
          {"pixel_error_reached", s.pixels_reached},
          {"bound_max", s.bound_max}};
}

Json summary(const Total& t, const Scene& scene, const std::string& device, double seconds) {
  return {{"seconds", seconds},
          {"frames", t.frames},
          {"pixels", std::size_t(scene.width) * std::size_t(scene.height) * std::size_t(t.frames)},
          {"patches", t.patches},
          {"bound_max", t.bound_max},
          {"pixel_error_asked", scene.pixel_error},
          {"pixel_error_reached", t.pixels_reached},
          {"stages",
           {{"query", t.query / 1000},
            {"fetch", t.fetch / 1000},
            {"blend", t.blend / 1000},
            {"tessellate", t.tessellate / 1000},
            {"draw", t.draw / 1000},
            {"write", t.write}}},
          {"contributors_mean", t.blended.mean()},
          {"contributors_max", t.blended.most},
          {"engine", device}};
}

RendererOptions options_of(const Scene& scene, const Options& o, const Common& common) {
  RendererOptions r = renderer_options(scene, common.memory);
  if (!o.tessellation.empty()) r.tessellation = kTessellations.at(o.tessellation);
  // A mesh takes more to make of each tile, and wins where tiles are drawn again.
  if (!r.tessellation && !scene.path && o.follow == 0) r.tessellation = Tessellation::hardware;
  return r;
}

// Draws frames one after another and writes each.
class Film {
 public:
  Film(const Options& o, const Common& common, const Scene& scene, Database& db)
      : o_(o), scene_(scene), device_(Device::open()), renderer_(device_, db, options_of(scene, o, common)) {}

  void shoot(const Camera& view, bool number) {
    const FrameStats s = renderer_.draw(view);
    const int k = total.frames;
    total.add(s);
    if (number && !scaled_ && s.tiles_drawn > 0) renderer_.keep_scale(), scaled_ = true;
    if (o_.stats) per_frame.push_back(facts(s));
    const Stopwatch writing;
    const auto name = [&](const std::string& path) { return number ? numbered(path, k) : path; };
    write_picture(name(o_.out), renderer_.picture());
    if (!o_.depth.empty()) write_depth(name(o_.depth), renderer_.depth(), scene_.width, scene_.height);
    total.write += writing.seconds();
  }

  // Another picture for each change that comes within the time.
  void follow(const Camera& view, Database& db, double seconds) {
    const Stopwatch watch;
    while (watch.seconds() < seconds) {
      if (renderer_.refresh(db))
        shoot(view, true);
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  const std::string& device() const { return device_->name(); }
  const std::string& tessellation() const {
    const auto used = [&](const auto& way) { return way.second == renderer_.tessellation(); };
    return std::find_if(kTessellations.begin(), kTessellations.end(), used)->first;
  }
  Total total;
  Json per_frame = Json::array();

 private:
  const Options& o_;
  const Scene& scene_;
  std::shared_ptr<Device> device_;
  Renderer renderer_;
  bool scaled_ = false;  // a picture of ground has given the overlay's scale
};

void run(const Options& o, const Common& common) {
  const Stopwatch watch;
  Database db = open_filled(o.database, common);
  refuse_overwriting(o.database, {o.out, o.depth});
  Scene scene = o.scene.empty() ? default_scene() : read_scene(o.scene);
  if (!o.size.empty()) scene.width = o.size[0], scene.height = o.size[1];
  if (o.pixel_error > 0) scene.pixel_error = o.pixel_error;
  const std::vector<Camera> views = cameras(db, scene);
  Film film(o, common, scene, db);
  {
    ProgressBar bar(common, "render", double(views.size()), "frames");
    for (std::size_t k = 0; k < views.size(); ++k) {
      film.shoot(views[k], scene.path || o.follow > 0);
      bar.show(double(k + 1) / double(views.size()));
    }
  }
  if (o.follow > 0) film.follow(views.back(), db, o.follow);
  const Total& t = film.total;
  Json document = summary(t, scene, film.device(), watch.seconds());
  document["tessellation"] = film.tessellation();
  if (o.stats) document["per_frame"] = film.per_frame;
  if (common.json || o.stats) return print(document);
  if (common.quiet) return;
  fmt::print(
      "{}: {} picture{} of {} x {}, {:.3g} px of error asked, {:.3g} reached, bound at most {:.4g} m, {:.2f} "
      "s\n",
      o.out, t.frames, t.frames == 1 ? "" : "s", scene.width, scene.height, scene.pixel_error,
      t.pixels_reached, t.bound_max, watch.seconds());
}

}  // namespace

void add_render(CLI::App& app, Common& common) {
  auto o = std::make_shared<Options>();
  CLI::App* v = verb(app, common, "render", "pictures of the terrain: one, or one for each frame of a path");
  v->add_option("DB", o->database, "the database")->required();
  v->add_option("OUT", o->out, "the PNG to write; along a path OUT_0000.png, OUT_0001.png, ...")->required();
  v->add_option("--scene", o->scene, "JSON: camera or path, pixel error, effects (render/scene.schema.json)");
  v->add_option("--size", o->size, "width height, pixels; else the scene's")
      ->expected(2)
      ->check(CLI::Range(1, 16384));
  v->add_option("--pixel-error", o->pixel_error, "largest error on the screen, pixels; else the scene's")
      ->check(above_zero());
  v->add_option("--depth", o->depth, "also writes metres along each pixel's ray (GeoTIFF)");
  v->add_option("--follow", o->follow,
                "seconds: another picture, OUT_0001.png, ..., for each change of the database")
      ->check(above_zero());
  v->add_flag("--stats", o->stats, "what each frame cost and reached, as JSON");
  v->add_option(
       "--tessellation", o->tessellation,
       "hardware: by the card's stages; mesh: by compute shaders; published: without the guarantee, for "
       "comparison. Else mesh where frames follow each other on a CPU device, and hardware")
      ->check(CLI::IsMember(kTessellations));
  v->add_flag("--json", common.json, "one JSON document on stdout");
  v->callback([o, &common] { run(*o, common); });
}

}  // namespace patchwork::cli
