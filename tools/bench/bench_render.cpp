// A flight at several pixel errors, each frame also drawn as the whole mesh, as chunks, by the other way to
// tessellate, and as published; and how far pixels lie from the best surface there is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/camera_path.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"
#include "tools/bench/render_peers.h"
#include "tools/error_figures.h"

namespace patchwork::cli {

namespace {

constexpr int kFramesARun = 12;
constexpr int kMeasured = 5, kEvery = 3;  // of so many frames of a flight, each so many pixels and rows
constexpr int kCoarsest = 16;             // half octaves of pixels
constexpr std::size_t kMeshVertices = std::size_t{2049} * 2049;  // a larger grid is not drawn as one mesh

// Back and forth over the terrain, from a third of the extent's height up to a little over the summits.
Flight flight_over(const Database& db, int frames) {
  const Extent e = db.extent();
  const HeightRange heights = db.heights();
  const auto at = [&](double x, double y, double z) {
    return Point3{e.xmin + x * (e.xmax - e.xmin), e.ymin + y * (e.ymax - e.ymin),
                  heights.lowest + z * (heights.highest - heights.lowest)};
  };
  Flight f;
  f.points = {at(0.2, 0.2, 1.3), at(0.4, 0.4, 1.05), at(0.7, 0.3, 1.15), at(0.8, 0.6, 1.1),
              at(0.5, 0.8, 1.2)};
  f.pitch = -12, f.frames = frames, f.fov_degrees = 60;
  return f;
}

// Times of one flight, a column for each way of drawing.
struct Times {
  std::vector<double> frame, other_frame, ours, other, published, mesh, chunked, screen, bare, covered;
  std::vector<double> triangles, made;
  double pixels = 0;
  std::vector<double> ours_off, mesh_off, chunked_off, published_off;  // pixels, of some frames
};

// One flight, and how far pixels were from the best surface there is; of the mesh where there is one.
struct Flown {
  std::string name;
  Work draw, frame;
  Spread mesh_ms;
  ErrorFigures ours, mesh;
};

double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[std::min(v.size() - 1, std::size_t(q * double(v.size())))];
}

// Each way of drawing is timed when it draws for the second time, so that none waits for memory where another
// has just been. A millimetre beside it, lest the same picture is not drawn again.
FrameStats drawn_again(Renderer& r, const Camera& camera) {
  Camera beside = camera;
  beside.eye.x += 1e-3;
  r.draw(beside);
  return r.draw(camera);
}
double draw_ms(const FrameStats& s) { return s.factors_ms + s.draw_ms; }
template <typename Draw>
double twice(const Draw& draw) {
  draw();
  return draw();
}

Json json_of(const ErrorFigures& f) { return {{"max", f.max}, {"p99", f.p99}, {"rms", f.rms}}; }

// The same flight as chunks, whose tiles keep to a pixel error.
struct ChunkFlight {
  double pixels;
  Spread ms;
  ErrorFigures error;
};

// Compared where no peer has a larger measured error: the fastest chunks that have none larger than ours, and
// ours where it is the coarsest that has none larger than the mesh.
std::vector<Work> at_equal_errors(const std::vector<Flown>& flights,
                                  const std::vector<ChunkFlight>& chunked) {
  std::vector<Work> all;
  const Flown* as_mesh = nullptr;
  for (const Flown& f : flights) {
    const ChunkFlight* best = nullptr;
    for (const ChunkFlight& c : chunked)
      if (c.error.max <= f.ours.max && (!best || c.ms.median < best->ms.median)) best = &c;
    if (f.ours.max <= f.mesh.max && (!as_mesh || f.ours.max > as_mesh->ours.max)) as_mesh = &f;
    if (!best) continue;
    const Json answer{
        {"pixel_error_measured", {{"ours", json_of(f.ours)}, {"chunked", json_of(best->error)}}},
        {"chunks_at_pixel_error", best->pixels}};
    all.push_back({"draw " + f.name + ", chunks of no larger error",
                   "ms",
                   true,
                   f.draw.ours,
                   {{"chunked", best->ms}},
                   answer});
  }
  if (!as_mesh) return all;
  const Json answer{
      {"pixel_error_measured", {{"ours", json_of(as_mesh->ours)}, {"full mesh", json_of(as_mesh->mesh)}}}};
  all.push_back({"draw " + as_mesh->name + ", no larger error than the mesh's",
                 "ms",
                 true,
                 as_mesh->draw.ours,
                 {{"full mesh", as_mesh->mesh_ms}},
                 answer});
  return all;
}

class Flights {
 public:
  Flights(const Database& db, const BenchOptions& o)
      : db_(db),
        device_(Device::open()),
        frames_(o.runs * kFramesARun),
        best_(db, extract(db, {.error = 0}).patches, {.smoothness = RendererOptions{}.smoothness}) {
    const Grid& g = db.grids().front();
    const auto vertices = std::size_t(g.info.shape.width()) * std::size_t(g.info.shape.height());
    mesh_ = vertices <= kMeshVertices ? &g : nullptr;
  }

  Flown fly(int width, int height, double pixel_error) {
    RendererOptions options{.width = width, .height = height, .pixel_error = pixel_error};
    Renderer ours(device_, db_, options);
    const bool mesh = ours.tessellation() == Tessellation::mesh;
    options.tessellation = mesh ? Tessellation::hardware : Tessellation::mesh;
    Renderer other(device_, db_, options);
    options.tessellation = Tessellation::published;
    Renderer published(device_, db_, options);
    RenderPeers peers(device_, db_, mesh_, width, height);
    const CameraPath path(flight_over(db_, frames_));
    Times t;
    for (int k = 0; k < path.frames(); ++k) {
      const Camera camera = path.frame(k, width, height);
      // In turns, because the second finds patches decoded.
      FrameStats s, a;
      if (k % 2)
        a = other.draw(camera), s = ours.draw(camera);
      else
        s = ours.draw(camera), a = other.draw(camera);
      t.frame.push_back(s.total_ms), t.other_frame.push_back(a.total_ms),
          t.made.push_back(double(s.tiles_made));
      if (k > 0) t.pixels = std::max(t.pixels, s.pixels_reached);
      const FrameStats again = drawn_again(ours, camera);
      t.triangles.push_back(double(again.triangles)), t.ours.push_back(draw_ms(again));
      t.other.push_back(draw_ms(drawn_again(other, camera)));
      t.published.push_back(draw_ms(drawn_again(published, camera)));
      t.chunked.push_back(twice([&] { return peers.chunked(ours); }));
      t.screen.push_back(twice([&] { return peers.full_screen(ours); }));
      t.bare.push_back(t.screen.back() + twice([&] { return peers.plain(ours, again.triangles); }));
      t.covered.push_back(t.screen.back() + twice([&] { return peers.covering(again.triangles); }));
      if (mesh_) t.mesh.push_back(twice([&] { return peers.full_mesh(camera); }));
      if (!is_measured(k)) continue;
      measure(camera, ours.depth(), t.ours_off), measure(camera, published.depth(), t.published_off);
      peers.stitched(ours), measure(camera, peers.depth(camera), t.chunked_off);
      if (mesh_) peers.full_mesh(camera), measure(camera, peers.depth(camera), t.mesh_off);
    }
    return flown(t, fmt::format("{} x {} at {:g} px", width, height, pixel_error),
                 mesh ? "hardware tessellation" : "mesh by compute");
  }

  ChunkFlight fly_chunks(int width, int height, double pixel_error) {
    Renderer tiles(device_, db_, {.width = width, .height = height, .pixel_error = pixel_error});
    RenderPeers peers(device_, db_, nullptr, width, height);
    const CameraPath path(flight_over(db_, frames_));
    std::vector<double> ms, off;
    for (int k = 0; k < path.frames(); ++k) {
      const Camera camera = path.frame(k, width, height);
      tiles.draw(camera);
      ms.push_back(twice([&] { return peers.chunked(tiles); }));
      if (is_measured(k)) peers.stitched(tiles), measure(camera, peers.depth(camera), off);
    }
    return {pixel_error, spread(ms), figures_of(off)};
  }

 private:
  bool is_measured(int frame) const { return frame % std::max(1, frames_ / kMeasured) == 0; }
  void measure(const Camera& camera, const std::vector<float>& depth, std::vector<double>& all) const {
    const std::vector<double> off = screen_distances(best_, camera, depth, kEvery);
    all.insert(all.end(), off.begin(), off.end());
  }
  // The first frame makes all tiles, and is not one of the flight.
  static Spread spread(const std::vector<double>& v) { return Spread::of({v.begin() + 1, v.end()}); }

  Flown flown(Times& t, const std::string& name, const std::string& other) const {
    Flown f{.name = name,
            .draw = {},
            .frame = {},
            .mesh_ms = {},
            .ours = figures_of(t.ours_off),
            .mesh = figures_of(t.mesh_off)};
    Json error{{"ours", json_of(f.ours)},
               {"published", json_of(figures_of(t.published_off))},
               {"chunked", json_of(figures_of(t.chunked_off))}};
    if (mesh_) f.mesh_ms = spread(t.mesh), error["full mesh"] = json_of(f.mesh);
    const Json answer{{"device", device_->name()},
                      {"frames", t.ours.size() - 1},
                      {"triangles_median", quantile(t.triangles, 0.5)},
                      {"tiles_made_a_frame", quantile(t.made, 0.5)},
                      {"pixel_error_reached", t.pixels},
                      {"pixel_error_measured", error},
                      {"draw_p99_ms", quantile({t.ours.begin() + 1, t.ours.end()}, 0.99)},
                      {"frame_p99_ms", quantile({t.frame.begin() + 1, t.frame.end()}, 0.99)}};
    Work& draw = f.draw = {"draw " + name, "ms", true, spread(t.ours), {}, answer};
    if (mesh_) draw.peers.emplace_back("full mesh", f.mesh_ms);
    draw.peers.emplace_back("chunked", spread(t.chunked));
    draw.peers.emplace_back(other, spread(t.other));
    draw.peers.emplace_back("published", spread(t.published));
    draw.peers.emplace_back("full screen", spread(t.screen));
    draw.peers.emplace_back("full screen + plain", spread(t.bare));
    draw.peers.emplace_back("full screen + plain over it", spread(t.covered));
    f.frame = {"frame " + name + ", tiles made", "ms", true, spread(t.frame), {}, answer};
    f.frame.peers.emplace_back(other, spread(t.other_frame));
    return f;
  }

  const Database& db_;
  std::shared_ptr<Device> device_;
  int frames_;
  Blend best_;
  const Grid* mesh_;
};

}  // namespace

std::vector<Work> bench_render(const BenchOptions& o) {
  const WorkFolder folder(o);
  const std::string path = folder.path("render.pwk");
  std::string heights = o.file;
  if (heights.empty()) {
    make_terrain(folder.path("terrain"),
                 {"--size", fmt::format("{}", o.size), "--type", "Int16", "--scale", "0.1"});
    heights = folder.path("terrain/base.tif");
  }
  run_process({own_program("patchwork"), "import", path, heights, "--accuracy", "1", "--quiet"});
  const Database db = Database::open(path);
  Flights flights(db, o);
  std::vector<Work> all;
  for (const auto& [width, height] : {std::pair{1280, 720}, std::pair{1920, 1080}}) {
    std::vector<Flown> flown;
    for (const double pixels : {1.0, 2.0, 4.0, 8.0}) flown.push_back(flights.fly(width, height, pixels));
    for (const Flown& f : flown) all.push_back(f.draw), all.push_back(f.frame);
    std::vector<ChunkFlight> chunked;
    // Coarser and coarser, until several are farther off than any of ours.
    double most = 0;
    for (const Flown& f : flown) most = std::max(most, f.ours.max);
    for (int k = 0, beyond = 0; k <= kCoarsest && beyond < 3; ++k) {
      chunked.push_back(flights.fly_chunks(width, height, std::exp2(0.5 * k)));
      beyond = chunked.back().error.max > most ? beyond + 1 : 0;
    }
    for (Work& w : at_equal_errors(flown, chunked)) all.push_back(std::move(w));
  }
  return all;
}

}  // namespace patchwork::cli
