#include "blend/blend.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "blend/batch.h"

namespace patchwork {

namespace {

constexpr std::size_t kParallelPoints = 16384;  // smaller parts are done by one thread

struct Worker {
  Batch batch;
  BlendCounts counts;
};

// What both kinds of evaluation share.
struct Run {
  const Database& db;
  const std::vector<Blend::Placed>& placed;
  const BlendOptions& options;
  const BlendOutput& out;
  tbb::enumerable_thread_specific<Worker> workers;

  bool priority() const { return options.composition == Composition::priority; }
  BlendCounts counts() {
    BlendCounts all;
    for (const Worker& w : workers) all += w.counts;
    return all;
  }
  void compose(Worker& w, const Candidates& candidates, bool inside) const {
    const bool named = !out.source.empty() || !out.patch.empty();
    w.batch.compose(db, placed, candidates, inside, named, options);
    w.counts += w.batch.counts;
  }
  // Points [k, k + n) of the batch go to the places from `to` on.
  void put(const Batch& batch, std::size_t k, std::size_t n, std::size_t to) const {
    const auto copy = [&](const auto& from, const auto& into) {
      if (!into.empty()) std::copy_n(from.data() + k, n, into.data() + to);
    };
    copy(batch.height, out.height), copy(batch.height, out.height32), copy(batch.bound, out.bound);
    copy(batch.source, out.source), copy(batch.patch, out.patch);
  }
};

// Points are halved along the longer side of their bounds, and the patches with them, until a batch is left.
class PointRun : public Run {
 public:
  PointRun(const Run& run, std::span<const double> x, std::span<const double> y) : Run(run), x_(x), y_(y) {}

  void halve(std::span<std::uint32_t> points, const Candidates& from) {
    Extent e = Extent::nothing();
    for (const std::uint32_t k : points) e.add(Point{x_[k], y_[k]});
    bool inside = false;
    const Candidates candidates = filter(placed, from, e.corners(), priority(), inside);
    // Few points under many patches are halved on: each batch asks all of its candidates about all of its
    // points.
    if (points.size() <= Batch::kPoints && (points.size() <= 32 || inside || candidates.size() <= 8)) {
      Worker& w = workers.local();
      Batch& batch = w.batch;
      batch.x.resize(points.size()), batch.y.resize(points.size());
      for (std::size_t k = 0; k < points.size(); ++k) batch.x[k] = x_[points[k]], batch.y[k] = y_[points[k]];
      compose(w, candidates, inside);
      for (std::size_t k = 0; k < points.size(); ++k) put(batch, k, 1, points[k]);
      return;
    }
    const auto& along = e.xmax - e.xmin > e.ymax - e.ymin ? x_ : y_;
    const auto middle = points.begin() + std::ptrdiff_t(points.size() / 2);
    std::nth_element(points.begin(), middle, points.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return along[a] < along[b]; });
    const auto low = points.first(points.size() / 2), high = points.subspan(points.size() / 2);
    if (points.size() < kParallelPoints) {
      halve(low, candidates), halve(high, candidates);
    } else {
      tbb::parallel_invoke([&] { halve(low, candidates); }, [&] { halve(high, candidates); });
    }
  }

 private:
  std::span<const double> x_, y_;
};

// The same for a rectangle of pixels.
class PixelRun : public Run {
 public:
  static constexpr int kSide = 32;
  PixelRun(const Run& run, const RasterFrame& raster, int width, int row)
      : Run(run), raster_(raster), width_(width), row_(row) {}

  void halve(int c0, int r0, int c1, int r1, const Candidates& from) {
    const Corners corners{at(c0, r0), at(c1 - 1, r0), at(c1 - 1, r1 - 1), at(c0, r1 - 1)};
    bool inside = false;
    const Candidates candidates = filter(placed, from, corners, priority(), inside);
    if (c1 - c0 <= kSide && r1 - r0 <= kSide) {
      evaluate(c0, r0, c1, r1, candidates, inside);
      return;
    }
    // Splits at multiples of the batch's side, so that batches are full.
    const auto middle = [](int a, int b) { return a + std::max(kSide, (b - a) / 2 / kSide * kSide); };
    const bool across = c1 - c0 >= r1 - r0;
    const int m = across ? middle(c0, c1) : middle(r0, r1);
    const auto low = [&] { across ? halve(c0, r0, m, r1, candidates) : halve(c0, r0, c1, m, candidates); };
    const auto high = [&] { across ? halve(m, r0, c1, r1, candidates) : halve(c0, m, c1, r1, candidates); };
    if (size_t(c1 - c0) * size_t(r1 - r0) < kParallelPoints)
      low(), high();
    else
      tbb::parallel_invoke(low, high);
  }

 private:
  Point at(int c, int r) const {
    return {raster_.x0 + (raster_.xc * c + raster_.xr * r), raster_.y0 + (raster_.yc * c + raster_.yr * r)};
  }
  void evaluate(int c0, int r0, int c1, int r1, const Candidates& candidates, bool inside) {
    Worker& w = workers.local();
    Batch& batch = w.batch;
    const std::size_t across = size_t(c1 - c0), n = across * size_t(r1 - r0);
    batch.x.resize(n), batch.y.resize(n);
    double *x = batch.x.data(), *y = batch.y.data();
    for (int r = r0; r < r1; ++r)
      for (int c = c0; c < c1; ++c) {
        const Point p = at(c, r);
        *x++ = p.x, *y++ = p.y;
      }
    compose(w, candidates, inside);
    for (int r = r0; r < r1; ++r)
      put(batch, size_t(r - r0) * across, across, size_t(r - row_) * size_t(width_) + size_t(c0));
  }
  const RasterFrame& raster_;
  int width_, row_;
};

Candidates all_of(const std::vector<Blend::Placed>& placed) {
  Candidates all(placed.size());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

}  // namespace

Blend::Blend(const Database& db, std::span<const PatchId> patches, const BlendOptions& options)
    : db_(db), options_(options) {
  assert(options.smoothness >= 0 && options.smoothness <= 2);
  auto placed = std::make_shared<std::vector<Placed>>();
  placed->reserve(patches.size());
  for (const PatchId id : patches) placed->push_back(place(db, id, options.smoothness));
  placed_ = std::move(placed);
}

BlendCounts Blend::at_points(std::span<const double> x, std::span<const double> y,
                             const BlendOutput& out) const {
  PointRun run({db_, *placed_, options_, out, {}}, x, y);
  std::vector<std::uint32_t> points(x.size());
  std::iota(points.begin(), points.end(), 0u);
  const auto finite = std::partition(points.begin(), points.end(), [&](std::uint32_t k) {
    return std::isfinite(x[k]) && std::isfinite(y[k]);
  });
  for (auto k = finite; k != points.end(); ++k) {
    if (!out.height.empty()) out.height[*k] = NAN;
    if (!out.bound.empty()) out.bound[*k] = NAN;
    if (!out.source.empty()) out.source[*k] = 0;
    if (!out.patch.empty()) out.patch[*k] = -1;
    if (!out.height32.empty()) out.height32[*k] = NAN;
  }
  if (finite != points.begin()) run.halve({points.begin(), finite}, all_of(*placed_));
  return run.counts();
}

BlendCounts Blend::at_pixels(const RasterFrame& raster, int width, int row, int rows,
                             const BlendOutput& out) const {
  PixelRun run({db_, *placed_, options_, out, {}}, raster, width, row);
  if (width > 0 && rows > 0) run.halve(0, row, width, row + rows, all_of(*placed_));
  return run.counts();
}

}  // namespace patchwork
