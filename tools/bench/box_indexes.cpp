#include "tools/bench/box_indexes.h"

#include <spatialindex/SpatialIndex.h>
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <cstring>

#include "db/error.h"
#include "db/vectorized.h"

namespace patchwork::cli {

namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;
namespace si = SpatialIndex;
using Corner = bg::model::point<double, 3, bg::cs::cartesian>;
using Box = bg::model::box<Corner>;
using Entry = std::pair<Box, std::uint32_t>;

// The sides of a view's region for a vector of eight: inside are the points with nx x + ny y <= most. What is
// positive of a normal stands apart from what is negative, so that a box's innermost corner needs no choice.
struct EightSides {
  static constexpr std::size_t kSides = 8;
  double nx_up[kSides] = {}, nx_down[kSides] = {}, ny_up[kSides] = {}, ny_down[kSides] = {}, most[kSides];

  explicit EightSides(const std::vector<Point>& corners) {
    if (corners.size() > kSides) throw Error("bench query", "a view has more than eight corners");
    std::fill_n(most, kSides, INFINITY);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Point &a = corners[k], &b = corners[(k + 1) % corners.size()];
      const double nx = b.y - a.y, ny = a.x - b.x;
      nx_up[k] = std::max(nx, 0.0), nx_down[k] = std::min(nx, 0.0);
      ny_up[k] = std::max(ny, 0.0), ny_down[k] = std::min(ny, 0.0);
      most[k] = nx * a.x + ny * a.y;
    }
  }
};

double lesser(double a, double b) { return a < b ? a : b; }
double greater(double a, double b) { return a > b ? a : b; }

PATCHWORK_VECTORIZED void near_enough(const LodPage& page, Point eye, double k, const Extent& bounds,
                                      std::uint8_t* __restrict hit) {
  double least[LodPage::kSlots];
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s) {
    const double left = page.xmin[s] - eye.x, right = eye.x - page.xmax[s];
    const double below = page.ymin[s] - eye.y, above = eye.y - page.ymax[s];
    const double fx = lesser(left, right), fy = lesser(below, above);
    const double dx = greater(greater(left, right), 0), dy = greater(greater(below, above), 0);
    const double bottom = page.bottom[s], top = page.top[s];
    const double outside = greater(greater(page.xmin[s] - bounds.xmax, bounds.xmin - page.xmax[s]),
                                   greater(page.ymin[s] - bounds.ymax, bounds.ymin - page.ymax[s]));
    least[s] = lesser(lesser(k * (fx * fx + fy * fy) - bottom * bottom, top * top - k * (dx * dx + dy * dy)),
                      -outside);
  }
  for (std::uint32_t s = 0; s < LodPage::kSlots; ++s) hit[s] = std::uint8_t(least[s] >= 0);
}

// Few boxes are left to be asked, so a vector takes the sides of one box.
PATCHWORK_VECTORIZED std::uint64_t keep_inside(const LodPage& page, const EightSides& e, std::uint64_t met) {
  using Numbers = double __attribute__((vector_size(EightSides::kSides * sizeof(double))));
  using Bytes = std::int8_t __attribute__((vector_size(EightSides::kSides)));
  Numbers nx_up, nx_down, ny_up, ny_down, most;
  std::memcpy(&nx_up, e.nx_up, sizeof(Numbers)), std::memcpy(&nx_down, e.nx_down, sizeof(Numbers));
  std::memcpy(&ny_up, e.ny_up, sizeof(Numbers)), std::memcpy(&ny_down, e.ny_down, sizeof(Numbers));
  std::memcpy(&most, e.most, sizeof(Numbers));
  for (std::uint64_t left = met; left; left &= left - 1) {
    const auto s = std::uint32_t(std::countr_zero(left));
    const Numbers at =
        (nx_up * page.xmin[s] + nx_down * page.xmax[s]) + (ny_up * page.ymin[s] + ny_down * page.ymax[s]);
    const Bytes out = __builtin_convertvector(at > most, Bytes);
    met &= ~(std::uint64_t{std::bit_cast<std::uint64_t>(out) != 0} << s);
  }
  return met;
}

// All boxes as they are, in six arrays, compared in vectors.
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
    if (!q.view) return scan([&](const LodPage& page) { return q.cut->hits(page, false).met; }, ids);
    const ConeOverRegion& v = *q.view;
    const EightSides sides(v.corners);
    scan(
        [&](const LodPage& page) {
          std::uint8_t hit[LodPage::kSlots];
          near_enough(page, v.eye, v.slope * v.slope, q.bounds, hit);
          const std::uint64_t met = page.mask_of_used(hit);
          return met ? keep_inside(page, sides, met) : met;
        },
        ids);
  }

 private:
  template <class Hits>
  void scan(Hits hits, Ids& ids) const {
    for (const LodPage& page : pages_)
      for (std::uint64_t left = hits(page); left; left &= left - 1)
        ids.push_back(page.ref[std::countr_zero(left)]);
  }
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

// libspatialindex, loaded in bulk (sort-tile-recursive), in memory.
template <double (*kScale)(double)>
class Spatial : public Index {
 public:
  explicit Spatial(const Boxes& boxes)
      : boxes_(boxes), storage_(si::StorageManager::createNewMemoryStorageManager()) {
    constexpr double kFill = 0.9;
    constexpr std::uint32_t kCapacity = 64, kDimensions = 3;
    si::id_type id;
    Stream stream(boxes);
    tree_.reset(si::RTree::createAndBulkLoadNewRTree(si::RTree::BLM_STR, stream, *storage_, kFill, kCapacity,
                                                     kCapacity, kDimensions, si::RTree::RV_RSTAR, id));
  }
  void find(const Question& q, Ids& ids) const override {
    Filter filter(boxes_, q, ids);
    tree_->intersectsWithQuery(
        region_of({q.bounds.xmin, q.bounds.ymin, q.bounds.xmax, q.bounds.ymax, 0, 0}, q.low, q.high), filter);
  }

 private:
  static si::Region region_of(const LodBox& b, double low, double high) {
    const double least[] = {b.xmin, b.ymin, kScale(low)}, most[] = {b.xmax, b.ymax, kScale(high)};
    return si::Region(least, most, 3);
  }
  class Stream : public si::IDataStream {
   public:
    explicit Stream(const Boxes& boxes) : boxes_(boxes) {}
    si::IData* getNext() override {
      si::Region r = region_of(boxes_[at_].box, double(boxes_[at_].box.bottom), double(boxes_[at_].box.top));
      return new si::RTree::Data(0, nullptr, r, si::id_type(at_++));
    }
    bool hasNext() override { return at_ < boxes_.size(); }
    std::uint32_t size() override { return std::uint32_t(boxes_.size()); }
    void rewind() override { at_ = 0; }

   private:
    const Boxes& boxes_;
    std::size_t at_ = 0;
  };
  class Filter : public si::IVisitor {
   public:
    Filter(const Boxes& boxes, const Question& q, Ids& ids) : boxes_(boxes), q_(q), ids_(ids) {}
    void visitNode(const si::INode&) override {}
    void visitData(const si::IData& d) override {
      if (const LodEntry& b = boxes_[std::size_t(d.getIdentifier())]; q_.meets(b.box))
        ids_.push_back(b.id.value);
    }
    void visitData(std::vector<const si::IData*>& all) override {
      for (const si::IData* d : all) visitData(*d);
    }

   private:
    const Boxes& boxes_;
    const Question& q_;
    Ids& ids_;
  };
  const Boxes& boxes_;
  std::unique_ptr<si::IStorageManager> storage_;
  std::unique_ptr<si::ISpatialIndex> tree_;
};

}  // namespace

std::vector<std::pair<std::string, std::unique_ptr<Index>>> peers_over(const Boxes& boxes) {
  std::vector<std::pair<std::string, std::unique_ptr<Index>>> peers;
  peers.emplace_back("linear scan", std::make_unique<Scan>(boxes));
  peers.emplace_back("Boost packed", std::make_unique<Boost<bgi::rstar<16>, as_is>>(boxes, false));
  peers.emplace_back("Boost packed by log error",
                     std::make_unique<Boost<bgi::rstar<16>, by_octave>>(boxes, false));
  peers.emplace_back("Boost R*", std::make_unique<Boost<bgi::rstar<16>, as_is>>(boxes, true));
  peers.emplace_back("SQLite R*Tree", std::make_unique<Sqlite>(boxes));
  peers.emplace_back("libspatialindex", std::make_unique<Spatial<as_is>>(boxes));
  peers.emplace_back("libspatialindex by log error", std::make_unique<Spatial<by_octave>>(boxes));
  return peers;
}

}  // namespace patchwork::cli
