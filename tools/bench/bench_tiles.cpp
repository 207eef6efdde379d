// Tiles in flight: which cache policy costs least, and how fast a camera may fly at the error it asked for.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <thread>

#include "db/stopwatch.h"
#include "render/renderer.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr double kPixelError = 2;
constexpr int kPolicyFrames = 120;
constexpr double kEnough = 0.99;  // share of tiles at the asked error
constexpr double kFlightSeconds = 2.5, kSettleSeconds = 0.5;
constexpr double kFirstSeconds = 3;  // until all is read
constexpr double kSlowest = 100;     // metres a second; doubled while it goes well
constexpr int kDoublings = 9;

// Where the camera is on a path of a kind, `way` metres after its beginning.
class Path {
 public:
  Path(const Database& db, std::string kind) : kind_(std::move(kind)), extent_(db.extent()) {
    top_ = std::max(0.0, db.heights().highest);
    side_ = std::min(extent_.xmax - extent_.xmin, extent_.ymax - extent_.ymin);
  }
  Camera at(double way) const {
    const double x = 0.5 * (extent_.xmin + extent_.xmax), y = 0.5 * (extent_.ymin + extent_.ymax);
    const double radius = 0.25 * side_;
    Point3 eye{x, y, top_ + 0.02 * side_};
    double heading = 0;
    if (kind_ == "circle") {
      const double a = way / radius;
      eye.x += radius * std::cos(a), eye.y += radius * std::sin(a), heading = -a;
    } else if (kind_ == "turn") {
      heading = way / radius;
    } else {  // to and fro along the diagonal's direction
      const double lap = 0.7 * side_, phase = std::fmod(way, 2 * lap),
                   s = phase < lap ? phase : 2 * lap - phase;
      eye.y += s - 0.5 * lap, heading = phase < lap ? 0 : std::numbers::pi;
    }
    return {eye, {eye.x + std::sin(heading), eye.y + std::cos(heading), eye.z - 0.25}, 60, kWidth, kHeight};
  }
  double length() const { return kind_ == "straight" ? 1.4 * side_ : 0.5 * std::numbers::pi * side_; }

 private:
  std::string kind_;
  Extent extent_;
  double side_ = 0, top_ = 0;
};

// The default first.
const std::pair<TilePolicy, const char*> kPolicies[] = {{TilePolicy::lru, "least recently used"},
                                                        {TilePolicy::lru_error, "smallest error"},
                                                        {TilePolicy::first, "first available"}};

// One way along the path with a pool that holds little more than a view.
Work policies(const std::shared_ptr<Device>& device, const Database& db, const std::string& kind) {
  const Path path(db, kind);
  std::vector<Spread> times;
  Json answer = Json::object();
  for (const auto& [policy, name] : kPolicies) {
    Renderer r(device, db,
               {.width = kWidth,
                .height = kHeight,
                .pixel_error = kPixelError,
                .memory = std::size_t{40} << 20,
                .policy = policy});
    std::vector<double> ms;
    std::size_t made = 0;
    double bookkeeping = 0;
    for (int k = 0; k < kPolicyFrames; ++k) {
      const FrameStats s = r.draw(path.at(path.length() * k / kPolicyFrames));
      if (k == 0) continue;
      ms.push_back(s.total_ms), made += s.tiles_made, bookkeeping += s.select_ms;
    }
    times.push_back(Spread::of(ms));
    answer[name] = {{"tiles_made", made},
                    {"evictions", r.cache().evictions()},
                    {"bookkeeping_ms", bookkeeping},
                    {"total_ms", std::accumulate(ms.begin(), ms.end(), 0.0)}};
  }
  Work w{"policy, " + kind, "ms a frame", true, times[0], {}, answer};
  for (std::size_t p = 1; p < times.size(); ++p) w.peers.emplace_back(kPolicies[p].second, times[p]);
  return w;
}

// Another process's surveys, that come and go while the camera flies.
class Surveyors {
 public:
  Surveyors(const std::string& database, const std::string& survey)
      : thread_([this, database, survey] {
          while (!ends_) {
            run_process({own_program("patchwork"), "import", database, survey, "--accuracy", "0.1", "--name",
                         "coming", "--quiet"});
            run_process({own_program("patchwork"), "remove", database, "coming", "--quiet"});
          }
        }) {}
  ~Surveyors() {
    ends_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

// A database, its copy, and a survey that comes and goes.
struct SurveyedLand {
  std::string path, twin, survey;
};

// What a flight at one speed did. Milliseconds, on the host.
struct Flown {
  std::size_t drawn = 0, coarse = 0, stale = 0, made = 0, sent = 0, bytes = 0,
              moves = 0;  // moves: of the database
  double extract = 0, send = 0, blend = 0, finish = 0, refresh = 0;
  std::vector<double> frames;
  double share() const { return drawn > 0 ? 1 - double(coarse) / double(drawn) : 1; }
  double newest() const { return drawn > 0 ? 1 - double(stale) / double(drawn) : 1; }

  void add(const FrameStats& s) {
    drawn += s.tiles_drawn, coarse += s.tiles_coarse, stale += s.tiles_stale;
    made += s.tiles_made, sent += s.patches_sent, bytes += s.bytes_up, frames.push_back(s.total_ms);
    extract += s.extract_ms, send += s.send_ms, blend += s.blend_ms, finish += s.finish_ms;
  }
  Json json(double speed) const {
    const Spread ms = Spread::of(frames);
    const double n = double(frames.size());
    return {{"speed", speed},
            {"share", share()},
            {"share_of_the_newest_state", newest()},
            {"frame_ms", ms.median},
            {"worst_ms", ms.max},
            {"frames", n},
            {"moves", moves},
            {"a_frame",
             {{"tiles", double(drawn) / n},
              {"tiles_made", double(made) / n},
              {"patches_sent", double(sent) / n},
              {"bytes_up", double(bytes) / n},
              {"refresh_ms", refresh / n},
              {"extract_ms", extract / n},
              {"send_ms", send / n},
              {"blend_ms", blend / n},
              {"finish_ms", finish / n}}}};
  }
};

Flown fly(Renderer& r, Database& db, const Path& path, double speed, double settle, double& way) {
  Flown f;
  const Stopwatch flight;
  Stopwatch frame;
  for (;;) {
    const Stopwatch watch;
    const bool moved = r.refresh(db);
    const double refreshing = watch.milliseconds();
    const FrameStats s = r.draw(path.at(way));
    way += speed * frame.lap();
    if (flight.seconds() < settle) continue;
    f.add(s), f.moves += moved, f.refresh += refreshing;
    if (flight.seconds() > settle + kFlightSeconds) return f;
  }
}

// Where surveys come and go while the camera flies: a control is the same work on another file.
enum class Surveyed { nowhere, elsewhere, here };

Work speed(const std::shared_ptr<Device>& device, const SurveyedLand& land, int workers, Surveyed surveyed) {
  Database db = Database::open(land.path);
  const Path path(db, "straight");
  Renderer r(device, db,
             {.width = kWidth,
              .height = kHeight,
              .pixel_error = kPixelError,
              .realtime = true,
              .make_ms = 12,
              .workers = workers});
  std::unique_ptr<Surveyors> surveyors;
  if (surveyed != Surveyed::nowhere)
    surveyors = std::make_unique<Surveyors>(surveyed == Surveyed::here ? land.path : land.twin, land.survey);
  double way = 0, best = 0;
  Json tried = Json::array();
  for (int n = 0; n < kDoublings; ++n) {
    const double metres = std::ldexp(kSlowest, n);
    const Flown f = fly(r, db, path, metres, n == 0 ? kFirstSeconds : kSettleSeconds, way);
    tried.push_back(f.json(metres));
    if (f.share() < kEnough) break;
    best = metres;
  }
  constexpr const char* kWhere[] = {"", ", surveys coming and going elsewhere", ", surveys coming and going"};
  return {fmt::format("speed, {} worker{}{}", workers, workers == 1 ? "" : "s", kWhere[int(surveyed)]),
          "m/s",
          false,
          {best, best, best},
          {},
          {{"share_wanted", kEnough}, {"pixel_error", kPixelError}, {"tried", tried}}};
}

}  // namespace

std::vector<Work> bench_tiles(const BenchOptions& o) {
  const WorkFolder folder(o);
  const std::string path = folder.path("tiles.pwk");
  const double middle = 5.0 * (o.size - 1);
  make_terrain(folder.path("terrain"),
               {"--size", fmt::format("{}", o.size), "--type", "Int16", "--scale", "0.1", "--survey",
                fmt::format("{},{},400,400,5,20,0.1", middle, middle)});
  run_process({own_program("patchwork"), "import", path, folder.path("terrain/base.tif"), "--accuracy", "0.2",
               "--quiet"});
  const auto device = Device::open();
  std::vector<Work> all;
  {
    const Database db = Database::open(path);
    for (const char* kind : {"circle", "turn", "straight"}) all.push_back(policies(device, db, kind));
  }
  const SurveyedLand land{path, folder.path("twin.pwk"), folder.path("terrain/survey_1.tif")};
  std::filesystem::copy_file(land.path, land.twin);
  for (const int workers : {1, 2})
    for (const Surveyed surveyed : {Surveyed::nowhere, Surveyed::elsewhere, Surveyed::here})
      all.push_back(speed(device, land, workers, surveyed));
  return all;
}

}  // namespace patchwork::cli
