// The knobs of `patchwork cost`, one at a time.
#include <fmt/format.h>
#include <malloc.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "db/error.h"
#include "db/stopwatch.h"
#include "tools/bench/bench.h"
#include "tools/cost/frames.h"
#include "tools/cost/reference.h"
#include "tools/cost/setting.h"
#include "tools/cost/uniform_grid.h"
#include "tools/sample_dataset.h"

namespace patchwork::cli {

namespace {

constexpr double kGathering = 0.3;   // about this part of the work is done before times are taken
constexpr int kAboutSettings = 160;  // uniform grids included
constexpr double kVisit = 0.02;      // seconds that a setting is run again for
constexpr int kMostOfAVisit = 4;
constexpr int kReferenceSide = 512, kReferencePoints = 4096;
constexpr int kSteps = 15;  // of the ladder of errors, 0 among them
constexpr int kMiddle = 7;  // the step at which the other knobs are turned
constexpr double kPixelErrors[] = {0.5, 1, 2, 4, 8, 16, 32, 50};
constexpr double kTolerances[] = {0, 0.01, 0.1, 1};  // metres
constexpr int kTiles[] = {17, 33, 65, 129};          // vertices along each side
constexpr std::size_t kMostSamples = 100'000'000;    // that are stored again for the tolerances

// Memory that is given back is not returned to the system: each run begins from nothing, and what it then
// costs to be given zeroed pages again depends on the machine's other tenants more than on the setting.
void keep_freed_memory() {
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
}

class Bench {
 public:
  Bench(const CostOptions& o, const Common& common)
      : o_(o), common_(common), folder_({}), db_(open_filled(o.database, common)), bar_(common, "cost") {
    extent_ = choose_extent();
    // The patches of every answer fit into the cache, so that reading them is apart from evaluating them.
    const std::size_t best = extract(db_, uniform(0)).patches.size();
    memory_ = std::max<std::uint64_t>(common.memory, 40 * best * sizeof(PatchSurface));
    db_ = Database::open(o.database, memory_);
    points_ = std::make_unique<CheckPoints>(db_, extent_, o.points);
    grid_ = std::make_unique<UniformGrid>(db_, extent_, *points_, folder_.path("uniform.tif"), common.memory);
    open_device();
    surfaces_ = std::make_unique<Surfaces>(device_, common.memory, memory_);
    make_ladder();
  }

  CostReport run() {
    report_.machine = machine_name(), report_.content_hash = db_.content_hash();
    report_.threads = threads(), report_.side = o_.side, report_.runs = o_.runs;
    report_.points = int(points_->size()), report_.extent = extent_;
    if (!grid_->complete())
      report_.notes.push_back(
          fmt::format("the uniform grid has a step of {:.4g} m: the finest of the grids "
                      "would take more than {} samples along a side",
                      grid_->step(), UniformGrid::kMostSide));
    for (const int side : {o_.side, o_.side / 2, o_.side / 8}) errors(side);
    pixel_errors(), blends(), engines(), sides(), thread_counts();
    uniform_grid(), frames(), tolerances(), reference();
    const auto until = start_ + std::chrono::round<std::chrono::steady_clock::duration>(
                                    std::chrono::duration<double>(o_.seconds));
    std::vector<MeasuredRun> runs;
    std::map<const MeasuredRun*, std::size_t> place;
    for (const Measurable& m : all_)
      if (place.emplace(m.once.get(), runs.size()).second) runs.push_back(several(*m.once));
    const std::vector<Stages> times =
        measure(runs, {.least = o_.runs, .until = until, .progress = [&](double share) {
                         bar_.show(kGathering + (1 - kGathering) * share);
                       }});
    std::set<const MeasuredRun*> seen;
    for (Measurable& m : all_) {
      m.row.again = !seen.insert(m.once.get()).second;
      report_.rows.push_back(std::move(m.row));
      report_.rows.back().ms = times[place[m.once.get()]];
    }
    return std::move(report_);
  }

 private:
  // What takes little time is run several times a visit, and the first one, which finds caches as another
  // setting left them, does not count.
  static MeasuredRun several(const MeasuredRun& once) {
    return [&once](Stages& ms) {
      const Stopwatch watch;
      Stages first;
      once(first);
      if (watch.seconds() >= kVisit) return ms.add(first);
      int runs = 0;
      do once(ms);
      while (++runs < kMostOfAVisit && watch.seconds() < kVisit);
    };
  }

  int threads() const { return common_.threads > 0 ? common_.threads : tbb::info::default_concurrency(); }
  UniformCut uniform(double error) const { return {.error = error, .region = Region::inside(extent_)}; }

  // Beyond its outer samples a grid is continued, and its bounds tell of little else.
  Extent within_samples() const {
    Extent all = Extent::nothing();
    for (const Grid& g : db_.grids()) all.add(g.info.frame.bounds(g.info.shape.samples()));
    return all;
  }

  // All of it, or a square in its middle whose best answer is not larger than kMostPatches.
  Extent choose_extent() {
    Extent e = within_samples();
    if (o_.extent.size() == 4) {
      e = {o_.extent[0], o_.extent[1], o_.extent[2], o_.extent[3]};
      if (!(e.xmin < e.xmax && e.ymin < e.ymax && e.meets(db_.extent())))
        throw Error("--extent", "it is empty or lies beside the database", "see: patchwork info");
    }
    for (;;) {
      const std::size_t n = extract(db_, {.error = 0, .region = Region::inside(e)}).patches.size();
      if (n <= kMostPatches) return e;
      report_.notes = {"measured in the middle of the database only, whose best answer has more than " +
                       std::to_string(kMostPatches) + " patches"};
      const double part = std::min(0.7, std::sqrt(double(kMostPatches) / double(n))),
                   x = (e.xmin + e.xmax) / 2, y = (e.ymin + e.ymax) / 2,
                   half = part * std::min(e.xmax - e.xmin, e.ymax - e.ymin) / 2;
      e = {x - half, y - half, x + half, y + half};
    }
  }

  void open_device() {
    try {
      device_ = Device::open();
      report_.engine = device_->name();
    } catch (const Error& e) {
      report_.notes.push_back(fmt::format("no graphics card was measured: {}", e.what()));
    }
  }

  // From the error at which the answer begins to differ from the best one to that of the coarsest patch.
  void make_ladder() {
    const double high = db_.coarsest_bottom();
    double low = 1e-6;
    const std::vector<PatchId> best = extract(db_, uniform(0)).patches;
    double differs = std::max(high, 2 * low);
    while (differs > 1.01 * low) {
      const double middle = std::sqrt(low * differs);
      (extract(db_, uniform(middle)).patches == best ? low : differs) = middle;
    }
    ladder_ = {0};
    for (int s = 1; s < kSteps; ++s)
      ladder_.push_back(low * std::pow(std::max(high / low, 1.), double(s - 1) / (kSteps - 2)));
  }

  Setting setting(const std::string& knob, const std::string& value, double error) const {
    return {.knob = knob,
            .value = value,
            .asked = error,
            .cut = make_surface(uniform(error)),
            .window = extent_,
            .db = &db_,
            .points = points_.get(),
            .side = o_.side,
            .threads = threads()};
  }
  Setting setting(const std::string& knob, const std::string& value) const {
    return setting(knob, value, ladder_[kMiddle]);
  }

  void add(const std::vector<Setting>& settings) {
    for (const Setting& s : settings) {
      const auto same =
          std::find_if(done_.begin(), done_.end(), [&](const auto& o) { return o.first.same_work(s); });
      all_.push_back(
          same != done_.end()
              ? all_[same->second]
              : Measurable{surfaces_->facts(s), std::make_shared<const MeasuredRun>(
                                                    [this, s](Stages& ms) { surfaces_->once(s, ms); })});
      all_.back().row.knob = s.knob, all_.back().row.value = s.value;
      if (same == done_.end()) done_.emplace_back(s, all_.size() - 1);
      bar_.show(std::min(kGathering, kGathering * double(all_.size()) / kAboutSettings));
    }
  }

  void errors(int side) {
    std::vector<Setting> all;
    for (const double error : ladder_) {
      all.push_back(setting(side == o_.side ? "error" : fmt::format("error_{}", side),
                            fmt::format("{:.4g}", error), error));
      all.back().side = side;
    }
    add(all);
  }

  ViewCut view() const {
    const Camera c = frame_scene(db_, extent_, o_.scene, common_.memory).camera;
    return over_terrain_of(
        db_,
        {.eye = c.eye, .look = c.look, .fov_degrees = c.fov_degrees, .width = c.width, .height = c.height});
  }

  void frames() {
    if (!device_) return;
    try {
      const FrameScene scene = frame_scene(db_, extent_, o_.scene, common_.memory);
      for (Measurable& m : frame_settings(db_, device_, scene)) all_.push_back(std::move(m));
      frames_drawn_ = true;
    } catch (const Error& e) {
      report_.notes.push_back(fmt::format("no frame was drawn: {}", e.what()));
    }
  }

  // Pixels a metre at the points that the view sees.
  std::vector<double> pixels_a_metre(const ViewCut& one_pixel) const {
    const std::vector<Point> corners = footprint(one_pixel);
    const auto surface = make_surface(one_pixel);
    std::vector<double> scale;
    for (std::size_t k = 0; k < points_->size(); ++k) {
      const Point at{points_->x()[k], points_->y()[k]};
      const double metres = surface->at(at);
      scale.push_back(sees(corners, at) && metres > 0 ? 1 / metres : -1);
    }
    return scale;
  }

  void pixel_errors() {
    ViewCut v = view();
    v.pixel_error = 1;
    scale_ = pixels_a_metre(v);
    if (std::none_of(scale_.begin(), scale_.end(), [](double s) { return s > 0; })) {
      report_.notes.push_back("the view sees nothing of the extent: no pixel errors");
      return;
    }
    window_ = Extent::nothing();
    for (const Point p : footprint(v)) window_.add(p);
    window_ = window_.common(extent_);
    std::vector<Setting> all;
    for (const double pixels : kPixelErrors) {
      v.pixel_error = pixels;
      Setting s = setting("pixel_error", fmt::format("{:g}", pixels), pixels);
      s.unit = "px", s.cut = make_surface(v), s.window = window_, s.scale = scale_;
      all.push_back(s);
    }
    add(all);
  }

  void blends() {
    std::vector<Setting> all;
    for (const int k : {0, 1, 2}) {
      all.push_back(setting("smoothness", std::to_string(k)));
      all.back().blend.smoothness = k, all.back().comparable = k == 0;
    }
    for (const char* name : {"priority", "weighted"}) {
      all.push_back(setting("blend", name));
      const bool weighted = std::string(name) == "weighted";
      all.back().comparable = !weighted;
      if (weighted) all.back().blend.composition = Composition::weighted;
    }
    add(all);
  }

  void engines() {
    std::vector<Setting> all{setting("engine", "cpu")};
    if (device_) {
      all.push_back(setting("engine", "vulkan"));
      all.back().vulkan = true, all.back().comparable = false;
      for (const int tile : kTiles) {
        all.push_back(setting("tile", std::to_string(tile)));
        all.back().vulkan = true, all.back().comparable = false, all.back().tile = tile;
      }
    }
    add(all);
  }

  void sides() {
    std::vector<Setting> all;
    for (int side = o_.side / 8; side <= 4 * o_.side; side *= 2) {
      all.push_back(setting("side", std::to_string(side)));
      all.back().side = side;
    }
    add(all);
  }

  void thread_counts() {
    std::vector<Setting> all;
    for (int n = 1; n <= threads(); n = n < threads() ? std::min(2 * n, threads()) : n + 1) {
      all.push_back(setting("threads", std::to_string(n)));
      all.back().threads = n, all.back().comparable = n == threads();
    }
    add(all);
  }

  // The grids stored again, to within a tolerance.
  void tolerances() {
    std::size_t samples = 0;
    for (const Grid& g : db_.grids())
      samples += std::size_t(g.info.shape.width()) * std::size_t(g.info.shape.height());
    if (samples > kMostSamples) {
      report_.notes.push_back("storage tolerances were not measured: more than 100 million samples");
      return;
    }
    for (const Grid& g : db_.grids())
      write_samples(db_, g.info, folder_.path(std::to_string(g.info.id.value) + ".tif"), {});
    for (const double tolerance : kTolerances) stored_.push_back(store_again(tolerance));
    std::vector<Setting> all;
    for (std::size_t k = 0; k < stored_.size(); ++k) {
      all.push_back(setting("tolerance", fmt::format("{:g}", kTolerances[k])));
      all.back().db = &stored_[k], all.back().comparable = false;
    }
    add(all);
  }

  Database store_again(double tolerance) const {
    const std::string path = folder_.path(fmt::format("tolerance-{:g}.pwk", tolerance));
    Database made = Database::open_or_create(path, db_.crs(), common_.memory);
    for (const Grid& g : db_.grids()) {
      const std::string file = folder_.path(std::to_string(g.info.id.value) + ".tif");
      made.import(RasterSource::open(file, {.accuracy = g.info.accuracy}, db_.crs()),
                  {.name = g.info.name, .memory = common_.memory, .tolerance = tolerance});
    }
    return Database::open(path, memory_);
  }

  // How fast the machine was meanwhile: the same terrain in every run of every database.
  void reference() {
    reference_ = make_reference(folder_.path(""), memory_);
    const Extent e = reference_->extent();
    reference_points_ = std::make_unique<CheckPoints>(*reference_, e, kReferencePoints);
    std::vector<Setting> all;
    for (const double error : kReferenceErrors) {
      Setting s = setting("reference", fmt::format("{:g} m", error), error);
      s.cut = make_surface(UniformCut{.error = error, .region = Region::inside(e)});
      s.window = e, s.db = &*reference_, s.points = reference_points_.get(), s.side = kReferenceSide;
      s.comparable = false;
      all.push_back(std::move(s));
    }
    add(all);
    if (frames_drawn_)
      all_.push_back(frame_setting(*reference_, device_, frame_scene(*reference_, e, "", common_.memory),
                                   "reference", 2));
  }

  // Rows of the uniform grid: each level over each window at each side that the knobs have.
  void uniform_grid() {
    std::vector<int> sides;
    for (int side = o_.side / 8; side <= 4 * o_.side; side *= 2) sides.push_back(side);
    for (const int side : sides) grid_levels(fmt::format("uniform_{}", side), "m", extent_, {}, side);
    if (window_.xmin < window_.xmax) grid_levels("uniform_view", "px", window_, scale_, o_.side);
  }
  void grid_levels(const std::string& knob, const std::string& unit, const Extent& window,
                   std::span<const double> scale, int side) {
    for (int level = 0; level < grid_->levels(); ++level) {
      CostRow row{.knob = knob, .value = fmt::format("1:{}", grid_->factor(level)), .unit = unit};
      row.error = grid_->error(level, scale), row.samples = double(side) * side;
      row.bytes = grid_->bytes(level), row.file_bytes = grid_->file_bytes();
      all_.push_back(
          {std::move(row), std::make_shared<const MeasuredRun>([this, level, window, side](Stages& ms) {
             ms.fetch.push_back(grid_->read(level, window, side));
           })});
    }
  }

  const CostOptions& o_;
  const Common& common_;
  WorkFolder folder_;
  Database db_;
  ProgressBar bar_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Extent extent_{}, window_{};  // window_: of the view
  std::uint64_t memory_ = 0;
  std::unique_ptr<CheckPoints> points_;
  std::unique_ptr<UniformGrid> grid_;
  std::shared_ptr<Device> device_;
  std::unique_ptr<Surfaces> surfaces_;
  std::vector<double> ladder_, scale_;
  std::vector<Database> stored_;  // again, to within the tolerances
  std::optional<Database> reference_;
  std::unique_ptr<CheckPoints> reference_points_;
  bool frames_drawn_ = false;
  std::vector<Measurable> all_;
  std::vector<std::pair<Setting, std::size_t>> done_;  // places in all_ of work that is no other's
  CostReport report_;
};

}  // namespace

CostReport measure_cost(const CostOptions& options, const Common& common) {
  keep_freed_memory();
  CostReport report = Bench(options, common).run();
  find_knee(report), find_bargains(report), fit_model(report);
  return report;
}

}  // namespace patchwork::cli
