// What a client on the other end of a wire needs to follow a view: bytes a frame of differences, and how many
// of their patches a prediction had fetched before. And what an answer costs that must keep to a time.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "query/cost_model.h"
#include "query/wire.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

constexpr int kFrames = 1000;
constexpr double kFramesPerSecond = 60;
constexpr int kAhead = 30;      // frames between a prediction and its use
constexpr int kEachAgain = 25;  // every so many frames the whole view is sent, as a peer
constexpr double kPixelError = 3;
// What a prediction asks for beside the predicted view itself: a wider one, finer and coarser by a seventh,
// because the camera will have turned, and be a little nearer or farther, than it seemed.
constexpr double kFov = 50, kWider = 1.3, kFiner = 6. / 7, kCoarser = 7. / 6;

// The state of a camera at a frame.
struct Camera {
  double x, y, heading;
};

// A path that swings to and fro by half a radian in eight seconds, or a turn on the spot.
struct Path {
  std::string name;
  double speed, turning;  // metres and radians a second
};

class Flight {
 public:
  Flight(const Database& db) : db_(db), extent_(db.extent()), top_(std::max(0.0, db.heights().highest)) {}

  Work fly(const Path& path) const {
    std::vector<double> bytes, whole;
    std::size_t added = 0, foreseen = 0, resident = 0;
    Camera camera{0.5 * (extent_.xmin + extent_.xmax), extent_.ymin + 0.2 * (extent_.ymax - extent_.ymin), 0};
    Extraction before;
    std::vector<std::vector<PatchId>> predictions;
    std::set<PatchId> fetched, shown;
    for (int frame = 0; frame < kFrames; ++frame) {
      const Camera next = moved(path, camera, frame);
      const Extraction now = seen(next);
      const Difference d = difference(now, before);
      if (frame > 0) bytes.push_back(double(encode_update(db_, d).size()));
      if (frame > kAhead) {
        added += d.add.size();
        for (const PatchId id : d.add) foreseen += fetched.contains(id);
      }
      if (frame % kEachAgain == 0) whole.push_back(double(encode_update(db_, {now.patches, {}}).size()));
      // From this frame and the last one to where the camera would be: at hand when that frame comes.
      predictions.push_back(foreseen_from(predicted(camera, next)));
      if (frame >= kAhead)
        for (const PatchId id : predictions[std::size_t(frame - kAhead)]) fetched.insert(id);
      shown.insert(now.patches.begin(), now.patches.end());
      resident += now.patches.size(), before = now, camera = next;
    }
    Work w{fmt::format("flight, {}", path.name), "bytes a frame", true, Spread::of(bytes), {}, {}};
    w.peers.emplace_back("whole view", Spread::of(whole));
    double sum = 0;
    for (const double b : bytes) sum += b;
    std::sort(bytes.begin(), bytes.end());
    w.answer = {{"frames", kFrames},
                {"pixel_error", kPixelError},
                {"bytes_mean", sum / double(bytes.size())},
                {"bytes_p95", bytes[bytes.size() * 95 / 100]},
                {"patches_added", added},
                {"patches_resident_mean", double(resident) / kFrames},
                {"share_predicted", added > 0 ? double(foreseen) / double(added) : 1},
                {"fetched_ahead", fetched.size()},
                {"used_of_these", used(fetched, shown)},
                {"paper_bytes", "few kB"}};
    return w;
  }

 private:
  static Camera moved(const Path& path, Camera c, int frame) {
    const double t = frame / kFramesPerSecond, dt = 1 / kFramesPerSecond;
    c.heading = path.turning > 0 ? path.turning * t : 0.5 * std::sin(2 * std::numbers::pi * t / 8);
    c.x += dt * path.speed * std::sin(c.heading), c.y += dt * path.speed * std::cos(c.heading);
    return c;
  }
  static Camera predicted(const Camera& before, const Camera& now) {
    return {now.x + kAhead * (now.x - before.x), now.y + kAhead * (now.y - before.y),
            now.heading + kAhead * (now.heading - before.heading)};
  }
  Extraction seen(const Camera& c, double fov = kFov, double pixel_error = kPixelError) const {
    ViewCut v{.eye = {c.x, c.y, top_ + 300}, .look = {}, .fov_degrees = fov, .pixel_error = pixel_error};
    v.look = {c.x + 5000 * std::sin(c.heading), c.y + 5000 * std::cos(c.heading), v.eye.z - 1000};
    return extract(db_, over_terrain_of(db_, v));
  }
  std::vector<PatchId> foreseen_from(const Camera& c) const {
    // A pixel of a wider view is larger: the same error in the plane is seen under fewer of them.
    const double wide = kFov * kWider,
                 zoom = std::tan(kFov * std::numbers::pi / 360) / std::tan(wide * std::numbers::pi / 360);
    std::vector<PatchId> all = seen(c).patches;
    for (const double times : {kFiner, kCoarser}) {
      const Extraction x = seen(c, wide, kPixelError * zoom * times);
      all.insert(all.end(), x.patches.begin(), x.patches.end());
    }
    return all;
  }
  static std::size_t used(const std::set<PatchId>& fetched, const std::set<PatchId>& shown) {
    std::size_t n = 0;
    for (const PatchId id : fetched) n += shown.contains(id);
    return n;
  }

  const Database& db_;
  Extent extent_;
  double top_;
};

// How much longer than asked an answer takes that is to keep to a time.
Work overrun(const Database& db, const CostModel& model, double milliseconds, int runs) {
  const auto cut_at = [](double error) { return make_surface(UniformCut{.error = error}); };
  std::vector<double> shares;
  Budgeted b;
  for (int n = 0; n < std::max(20, runs); ++n) {
    b = extract_in_time(db, model, milliseconds / 1000, 1000, cut_at);
    shares.push_back(1000 * b.extraction.cost.seconds / milliseconds);
  }
  Work w{fmt::format("budget of {:g} ms", milliseconds),
         "time taken / time asked",
         true,
         Spread::of(shares),
         {},
         {}};
  std::sort(shares.begin(), shares.end());
  w.answer = {{"error", b.error},
              {"patches", b.extraction.patches.size()},
              {"p95", shares[shares.size() * 95 / 100]},
              {"model", {{"seconds", model.fixed}, {"page", model.page}, {"patch", model.patch}}}};
  return w;
}

}  // namespace

std::vector<Work> bench_flight(const BenchOptions& o) {
  const WorkFolder folder(o);
  const std::string path = folder.path("flight.pwk");
  make_terrain(folder.path("terrain"),
               {"--size", fmt::format("{}", o.size), "--type", "Int16", "--scale", "0.1"});
  run_process({own_program("patchwork"), "import", path, folder.path("terrain/base.tif"), "--accuracy", "0.2",
               "--quiet"});
  const Database db = Database::open(path);
  std::vector<Work> works;
  for (const Path& p : {Path{"50 m/s", 50, 0}, Path{"200 m/s", 200, 0}, Path{"800 m/s", 800, 0},
                        Path{"turning 30 degrees/s", 0, std::numbers::pi / 6}})
    works.push_back(Flight(db).fly(p));
  const CostModel model = calibrate(db);
  for (const double milliseconds : {1.0, 4.0, 16.0})
    works.push_back(overrun(db, model, milliseconds, o.runs));
  return works;
}

}  // namespace patchwork::cli
