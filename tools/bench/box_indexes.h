// Indexes of boxes that answer the questions of `patchwork bench query`: ours and those one could use
// instead.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "db/lod_tree.h"
#include "query/cut.h"

namespace patchwork::cli {

using Boxes = std::vector<LodEntry>;
using Ids = std::vector<std::uint64_t>;

/// A view as peers ask it: a box is met if it meets the convex region of these corners, and its errors meet
/// slope times the distances from the eye.
struct ConeOverRegion {
  Point eye;
  double slope = 0;
  std::vector<Point> corners;  ///< counterclockwise
};

/// All boxes that a cut meets. `bounds` and the errors from `low` to `high` hold every one of them.
struct Question {
  std::unique_ptr<CutSurface> cut;
  Extent bounds;
  double low, high;
  std::optional<ConeOverRegion> view;        ///< where it is one
  std::function<bool(const LodBox&)> meets;  ///< what a peer must test behind its own search
};

/// Answers a question by the ids of the boxes, put behind those that are there.
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

/// A vectorised linear scan, Boost.Geometry's R-tree (packed, packed by the logarithm of the error, R*),
/// SQLite's R*Tree with a query callback, libspatialindex (bulk-loaded, both ways). REQUIRES: `boxes` outlive
/// them.
std::vector<std::pair<std::string, std::unique_ptr<Index>>> peers_over(const Boxes& boxes);

}  // namespace patchwork::cli
