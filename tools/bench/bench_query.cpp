// Which boxes does a question meet: the LOD-space tree beside the indexes that one could use instead.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "db/error.h"
#include "db/stopwatch.h"
#include "query/extract.h"
#include "tools/bench/bench.h"
#include "tools/bench/box_indexes.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

class QueryBench {
 public:
  QueryBench(const BenchOptions& o, const WorkFolder& folder, int size) : o_(o) {
    const std::string name = fmt::format("{}", size), path = folder.path(name + ".pwk");
    const Json terrain =
        make_terrain(folder.path(name), {"--size", name, "--type", "Int16", "--scale", "0.1"});
    run_process({own_program("patchwork"), "import", path, folder.path(name + "/base.tif"), "--accuracy",
                 "0.2", "--quiet"});
    const Database db = Database::open(path);
    const Database::Reading reading = db.reading();
    db.tree().traverse([](const LodBox&) { return true; }, [&](const LodEntry& e) { boxes_.push_back(e); });
    // In an order that no index made: by place in the grid.
    std::sort(boxes_.begin(), boxes_.end(), [](const LodEntry& a, const LodEntry& b) { return a.id < b.id; });
    extent_ = db.extent();
    heights_ = {db.grids()[0].info.lowest, db.grids()[0].info.highest};
    for (const LodEntry& e : boxes_) bottoms_.push_back(e.box.bottom);
    std::sort(bottoms_.begin(), bottoms_.end());
  }

  void run(std::vector<Work>& works) {
    const Ours ours(boxes_);
    const auto peers = peers_over(boxes_);
    for (const char* kind : {"everything", "sparse", "region", "view"}) {
      const std::vector<Question> questions = make(kind);
      Work w{fmt::format("{}, {} boxes", kind, boxes_.size()), "queries/s", false, {}, {}, {}};
      std::size_t results = 0;
      VisitCost cost;
      for (const Question& q : questions) {
        const std::size_t n = count(ours, q);
        results += n, cost.nodes += ours.cost().nodes, cost.boxes += ours.cost().boxes;
        for (const auto& [name, peer] : peers)
          if (const std::size_t theirs = count(*peer, q);
              std::abs(double(theirs) - double(n)) > 0.05 * double(n) + 8)
            throw Error("bench query", fmt::format("{} finds {} boxes for {} {}", name, theirs, kind, n));
      }
      std::vector<std::vector<double>> rates(1 + peers.size());
      for (int r = 0; r < o_.runs; ++r)
        for (std::size_t i = 0; i < rates.size(); ++i)
          rates[i].push_back(
              rate(i == 0 ? static_cast<const Index&>(ours) : *peers[i - 1].second, questions));
      w.ours = Spread::of(rates[0]);
      for (std::size_t i = 0; i < peers.size(); ++i)
        w.peers.emplace_back(peers[i].first, Spread::of(rates[i + 1]));
      const double n = double(questions.size());
      w.answer = {
          {"boxes", boxes_.size()},
          {"results_mean", double(results) / n},
          {"pages_mean", double(cost.nodes) / n},
          {"visited_per_result", double(results + cost.nodes) / double(std::max<std::size_t>(results, 1))},
          {"compared_per_result", double(cost.boxes) / double(std::max<std::size_t>(results, 1))},
          {"paper_queries_per_second", {{"uniform", {55, 800}}, {"view", 400}}}};
      works.push_back(std::move(w));
    }
  }

 private:
  static std::size_t count(const Index& index, const Question& q) {
    Ids ids;
    index.find(q, ids);
    return ids.size();
  }

  // Rounds over the questions until enough time has passed to be measured.
  static double rate(const Index& index, const std::vector<Question>& questions) {
    constexpr double kLeast = 0.15;
    std::size_t asked = 0;
    Ids ids;
    const Stopwatch watch;
    double passed = 0;
    for (std::size_t k = 0; passed < kLeast; k = (k + 1) % questions.size()) {
      ids.clear(), index.find(questions[k], ids), ++asked;
      if (asked % 8 == 0 || passed == 0) passed = watch.seconds();
    }
    return double(asked) / watch.seconds();
  }

  Question uniform(double error, const Extent& region) const {
    const float limit = float_at_most(error);
    return {
        make_surface(UniformCut{.error = error, .region = Region::inside(region)}),
        region,
        error,
        error,
        {},
        [=](const LodBox& b) {
          return Extent{b.xmin, b.ymin, b.xmax, b.ymax}.meets(region) && b.bottom <= limit && limit < b.top;
        }};
  }

  std::vector<Question> make(const std::string& kind) const {
    std::mt19937_64 random(7);
    const auto between = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    const double side = extent_.xmax - extent_.xmin;
    std::vector<Question> all;
    if (kind == "everything") all.push_back(uniform(0, extent_));
    // An error that about one box in ninety outlasts: 5000 of 456 000.
    if (kind == "sparse")
      all.push_back(uniform(double(bottoms_[bottoms_.size() - bottoms_.size() / 110 - 1]), extent_));
    for (int n = 0; n < 200 && kind == "region"; ++n) {
      const double x = between(extent_.xmin, extent_.xmax - 0.1 * side),
                   y = between(extent_.ymin, extent_.ymax - 0.1 * side);
      all.push_back(uniform(0, {x, y, x + 0.1 * side, y + 0.1 * side}));
    }
    for (int n = 0; n < 200 && kind == "view"; ++n) all.push_back(view(between, side));
    return all;
  }

  template <class Between>
  Question view(Between between, double side) const {
    ViewCut v{.eye = {between(extent_.xmin, extent_.xmax), between(extent_.ymin, extent_.ymax),
                      heights_.second + 300},
              .look = {},
              .fov_degrees = 50,
              .pixel_error = 4,
              .far = 0.5 * side,
              .lowest = heights_.first,
              .highest = heights_.second};
    const double a = between(0, 2 * M_PI);
    v.look = {v.eye.x + 5000 * std::cos(a), v.eye.y + 5000 * std::sin(a), v.eye.z - 1000};
    Question q{make_surface(v), Extent::nothing(), INFINITY, 0, ConeOverRegion{}, {}};
    for (const Point& p : footprint(v)) {
      q.bounds.add(p);
      q.high = std::max(q.high, q.cut->at(p));
    }
    // The eye lies over the region, or near it; and a patch is asked for over its whole domain, which reaches
    // beyond the region.
    q.low = 0, q.high += q.cut->at({v.eye.x + side, v.eye.y + side});
    *q.view = {{v.eye.x, v.eye.y}, q.cut->at({v.eye.x + 1, v.eye.y}), footprint(v)};
    q.meets = [view = *q.view](const LodBox& b) {
      const auto& [eye, slope, corners] = view;
      const double x = eye.x, y = eye.y;
      const double dx = std::max({b.xmin - x, x - b.xmax, 0.0}), dy = std::max({b.ymin - y, y - b.ymax, 0.0});
      const double fx = std::max(std::abs(b.xmin - x), std::abs(b.xmax - x)),
                   fy = std::max(std::abs(b.ymin - y), std::abs(b.ymax - y));
      if (b.bottom > slope * std::sqrt(fx * fx + fy * fy) || slope * std::sqrt(dx * dx + dy * dy) >= b.top)
        return false;
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const Point &p = corners[k], &n = corners[(k + 1) % corners.size()];
        const double nx = n.y - p.y, ny = p.x - n.x;
        if (nx * (nx > 0 ? b.xmin : b.xmax) + ny * (ny > 0 ? b.ymin : b.ymax) > nx * p.x + ny * p.y)
          return false;
      }
      return true;
    };
    return q;
  }

  const BenchOptions& o_;
  Boxes boxes_;
  std::vector<float> bottoms_;
  Extent extent_;
  std::pair<double, double> heights_;
};

}  // namespace

std::vector<Work> bench_query(const BenchOptions& o) {
  const WorkFolder folder(o);
  std::vector<Work> works;
  for (const int size : {16385, 6849, 1713})  // 456 000, 80 000 and 5000 patches
    if (size <= o.size || size == 1713) QueryBench(o, folder, size).run(works);
  return works;
}

}  // namespace patchwork::cli
