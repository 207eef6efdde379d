// A flight at several pixel errors, each frame also drawn as the whole mesh, as chunks, by the other way to
// tessellate, and as published.
#include <fmt/format.h>

#include <algorithm>

#include "render/camera_path.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"
#include "tools/bench/render_peers.h"

namespace patchwork::cli {

namespace {

constexpr int kFramesARun = 12;
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
  std::vector<double> frame, other_frame, ours, other, published, mesh, chunked, screen, bare;
  std::vector<double> triangles, made;
  double pixels = 0;
};

double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[std::min(v.size() - 1, std::size_t(q * double(v.size())))];
}

class Flights {
 public:
  Flights(const Database& db, const BenchOptions& o)
      : db_(db), device_(Device::open()), frames_(o.runs * kFramesARun) {
    const Grid& g = db.grids().front();
    const auto vertices = std::size_t(g.info.shape.width()) * std::size_t(g.info.shape.height());
    mesh_ = vertices <= kMeshVertices ? &g : nullptr;
  }

  std::vector<Work> fly(int width, int height, double pixel_error) {
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
      t.frame.push_back(s.total_ms), t.ours.push_back(s.factors_ms + s.draw_ms);
      t.triangles.push_back(double(s.triangles)), t.made.push_back(double(s.tiles_made));
      if (k > 0) t.pixels = std::max(t.pixels, s.pixels_reached);
      t.other_frame.push_back(a.total_ms), t.other.push_back(a.factors_ms + a.draw_ms);
      const FrameStats p = published.draw(camera);
      t.published.push_back(p.factors_ms + p.draw_ms);
      t.chunked.push_back(peers.chunked(ours));
      t.screen.push_back(peers.full_screen(ours));
      t.bare.push_back(t.screen.back() + peers.plain(ours, s.triangles));
      if (mesh_) t.mesh.push_back(peers.full_mesh(camera));
    }
    return works(t, fmt::format("{} x {} at {:g} px", width, height, pixel_error),
                 mesh ? "hardware tessellation" : "mesh by compute");
  }

 private:
  // The first frame makes all tiles, and is not one of the flight.
  static Spread spread(const std::vector<double>& v) { return Spread::of({v.begin() + 1, v.end()}); }

  std::vector<Work> works(const Times& t, const std::string& name, const std::string& other) const {
    const Json answer{{"device", device_->name()},
                      {"frames", t.ours.size() - 1},
                      {"triangles_median", quantile(t.triangles, 0.5)},
                      {"tiles_made_a_frame", quantile(t.made, 0.5)},
                      {"pixel_error_reached", t.pixels},
                      {"draw_p99_ms", quantile({t.ours.begin() + 1, t.ours.end()}, 0.99)},
                      {"frame_p99_ms", quantile({t.frame.begin() + 1, t.frame.end()}, 0.99)}};
    Work draw{"draw " + name, "ms", true, spread(t.ours), {}, answer};
    if (!t.mesh.empty()) draw.peers.emplace_back("full mesh", spread(t.mesh));
    draw.peers.emplace_back("chunked", spread(t.chunked));
    draw.peers.emplace_back(other, spread(t.other));
    draw.peers.emplace_back("published", spread(t.published));
    draw.peers.emplace_back("full screen", spread(t.screen));
    draw.peers.emplace_back("full screen + plain", spread(t.bare));
    Work frame{"frame " + name + ", tiles made", "ms", true, spread(t.frame), {}, answer};
    frame.peers.emplace_back(other, spread(t.other_frame));
    return {draw, frame};
  }

  const Database& db_;
  std::shared_ptr<Device> device_;
  int frames_;
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
  for (const auto& [width, height] : {std::pair{1280, 720}, std::pair{1920, 1080}})
    for (const double pixels : {1.0, 2.0, 4.0})
      for (Work& w : flights.fly(width, height, pixels)) all.push_back(std::move(w));
  return all;
}

}  // namespace patchwork::cli
