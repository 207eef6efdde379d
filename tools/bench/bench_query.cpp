// Which boxes does a question meet: the LOD-space tree beside the indexes that one could use instead.
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <chrono>
#include <cmath>
#include <map>
#include <random>

#include "db/error.h"
#include "query/extract.h"
#include "tools/bench/bench.h"
#include "tools/bench/process.h"

namespace patchwork::cli {

namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;
using Corner = bg::model::point<double, 3, bg::cs::cartesian>;
using Box = bg::model::box<Corner>;
using Entry = std::pair<Box, std::uint32_t>;
using Boxes = std::vector<LodEntry>;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// A question: all boxes that a cut meets. `bounds` and the errors from `low` to `high` hold every one of
// them.
struct Question {
  std::unique_ptr<CutSurface> cut;
  Extent bounds;
  double low, high;
  std::function<bool(const LodBox&)> meets;  // what a peer must test behind its own search
};

using Ids = std::vector<std::uint64_t>;

// Each answers a question by the ids of the boxes, put behind those that are there.
class Index {
 public:
  virtual ~Index() = default;
  virtual void find(const Question& q, Ids& ids) const = 0;
};

class Ours : public Index {
 public:
  explicit Ours(const Boxes& boxes) : tree_(LodTree::build(boxes)) {}
  void find(const Question& q, Ids& ids) const override {
    cost_ = tree_.visit([&](const LodPage& page, bool inside) { return q.cut->hits(page, inside); },
                        [&](const LodEntry& e) { ids.push_back(e.id.value); });
  }
  const VisitCost& cost() const { return cost_; }

 private:
  LodTree tree_;
  mutable VisitCost cost_;
};

// All boxes in six arrays, compared in vectors.
class Scan : public Index {
 public:
  explicit Scan(const Boxes& boxes) {
    for (std::size_t k = 0; k < boxes.size(); k += LodPage::kSlots) {
      LodPage page(0);
      for (std::size_t i = k; i < std::min(boxes.size(), k + LodPage::kSlots); ++i) page.append(boxes[i]);
      pages_.push_back(page);
    }
  }
  void find(const Question& q, Ids& ids) const override {
    for (const LodPage& page : pages_)
      for (std::uint64_t left = q.cut->hits(page, false).met; left; left &= left - 1)
        ids.push_back(page.ref[std::countr_zero(left)]);
  }

 private:
  std::vector<LodPage> pages_;
};

double as_is(double e) { return std::min(e, 1e30); }
double by_octave(double e) { return std::log2(std::min(e, 1e30) + 1e-3); }

template <class Params, double (*kScale)(double)>
class Boost : public Index {
 public:
  Boost(const Boxes& boxes, bool one_by_one) : boxes_(boxes) {
    std::vector<Entry> entries;
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const LodBox& b = boxes[k].box;
      entries.emplace_back(
          Box({b.xmin, b.ymin, kScale(double(b.bottom))}, {b.xmax, b.ymax, kScale(double(b.top))}),
          std::uint32_t(k));
    }
    if (one_by_one)
      for (const Entry& e : entries) tree_.insert(e);
    else
      tree_ = bgi::rtree<Entry, Params>(entries);
  }
  void find(const Question& q, Ids& ids) const override {
    const Box box({q.bounds.xmin, q.bounds.ymin, kScale(q.low)},
                  {q.bounds.xmax, q.bounds.ymax, kScale(q.high)});
    for (auto e = tree_.qbegin(bgi::intersects(box)); e != tree_.qend(); ++e)
      if (const LodEntry& b = boxes_[e->second]; q.meets(b.box)) ids.push_back(b.id.value);
  }

 private:
  const Boxes& boxes_;
  bgi::rtree<Entry, Params> tree_;
};

// SQLite's R*Tree with a query callback: the cut is asked for every node.
class Sqlite : public Index {
 public:
  explicit Sqlite(const Boxes& boxes) {
    sqlite3_open(":memory:", &db_);
    exec("CREATE VIRTUAL TABLE t USING rtree(id, x0, x1, y0, y1, e0, e1); BEGIN");
    sqlite3_stmt* s = nullptr;
    sqlite3_prepare_v2(db_, "INSERT INTO t VALUES(?, ?, ?, ?, ?, ?, ?)", -1, &s, nullptr);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const LodBox& b = boxes[k].box;
      const double sides[] = {b.xmin, b.xmax, b.ymin, b.ymax, double(b.bottom), as_is(double(b.top))};
      sqlite3_bind_int64(s, 1, std::int64_t(k));
      for (int i = 0; i < 6; ++i) sqlite3_bind_double(s, 2 + i, sides[i]);
      sqlite3_step(s), sqlite3_reset(s);
    }
    sqlite3_finalize(s);
    exec("COMMIT");
    sqlite3_rtree_query_callback(db_, "cut", &Sqlite::ask, this, nullptr);
    sqlite3_prepare_v2(db_, "SELECT id FROM t WHERE id MATCH cut()", -1, &query_, nullptr);
  }
  ~Sqlite() override { sqlite3_finalize(query_), sqlite3_close(db_); }
  void find(const Question& q, Ids& ids) const override {
    asked_ = &q;
    while (sqlite3_step(query_) == SQLITE_ROW) ids.push_back(std::uint64_t(sqlite3_column_int64(query_, 0)));
    sqlite3_reset(query_);
  }

 private:
  void exec(const char* sql) {
    if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) != SQLITE_OK)
      throw Error("SQLite", sqlite3_errmsg(db_), "its R*Tree module is needed");
  }
  static int ask(sqlite3_rtree_query_info* info) {
    const sqlite3_rtree_dbl* c = info->aCoord;
    const LodBox box{c[0], c[2], c[1], c[3], float(c[4]), c[5] >= 1e30 ? INFINITY : float(c[5])};
    info->eWithin = static_cast<Sqlite*>(info->pContext)->asked_->meets(box) ? PARTLY_WITHIN : NOT_WITHIN;
    info->rScore = info->rParentScore;
    return SQLITE_OK;
  }
  sqlite3* db_ = nullptr;
  sqlite3_stmt* query_ = nullptr;
  mutable const Question* asked_ = nullptr;
};

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
    std::vector<std::pair<std::string, std::unique_ptr<Index>>> peers;
    peers.emplace_back("linear scan", std::make_unique<Scan>(boxes_));
    peers.emplace_back("Boost packed", std::make_unique<Boost<bgi::rstar<16>, as_is>>(boxes_, false));
    peers.emplace_back("Boost packed by log error",
                       std::make_unique<Boost<bgi::rstar<16>, by_octave>>(boxes_, false));
    peers.emplace_back("Boost R*", std::make_unique<Boost<bgi::rstar<16>, as_is>>(boxes_, true));
    peers.emplace_back("SQLite R*Tree", std::make_unique<Sqlite>(boxes_));
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
      w.answer = {{"boxes", boxes_.size()},
                  {"results_mean", double(results) / n},
                  {"pages_mean", double(cost.nodes) / n},
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
    const double start = now();
    double passed = 0;
    for (std::size_t k = 0; passed < kLeast; k = (k + 1) % questions.size()) {
      ids.clear(), index.find(questions[k], ids), ++asked;
      if (asked % 8 == 0 || passed == 0) passed = now() - start;
    }
    return double(asked) / (now() - start);
  }

  Question uniform(double error, const Extent& region) const {
    const float limit = float_at_most(error);
    return {
        make_surface(UniformCut{.error = error, .region = Region::inside(region)}), region, error, error,
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
    Question q{make_surface(v), {INFINITY, INFINITY, -INFINITY, -INFINITY}, INFINITY, 0, {}};
    for (const Point& p : footprint(v)) {
      Extent& b = q.bounds;
      b = {std::min(b.xmin, p.x), std::min(b.ymin, p.y), std::max(b.xmax, p.x), std::max(b.ymax, p.y)};
      q.high = std::max(q.high, q.cut->at(p));
    }
    // The eye lies over the region, or near it; and a patch is asked for over its whole domain, which reaches
    // beyond the region.
    q.low = 0, q.high += q.cut->at({v.eye.x + side, v.eye.y + side});
    q.meets = [corners = footprint(v), x = v.eye.x, y = v.eye.y,
               slope = q.cut->at({v.eye.x + 1, v.eye.y})](const LodBox& b) {
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
