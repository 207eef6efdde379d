// VulkanBlend's rasters and points, which stream back to the host.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numeric>

#include "blend/vulkan/vulkan_blend_impl.h"

namespace patchwork {

namespace {

constexpr std::size_t kGroup = 64;                          // points of a work group: exact.comp
constexpr std::size_t kBatchPoints = std::size_t{1} << 16;  // so that the engine of `sample` has some in turn

// Rows of a tile go to their places in a raster.
class RasterSink {
 public:
  RasterSink(const BlendOutput& out, std::span<const Tile> tiles, int width, int row)
      : out_(out), tiles_(tiles), width_(width), row_(row) {}

  void take(const TileHeights& h) const {
    const std::size_t side = std::size_t(h.side);
    for (std::size_t k = 0; k < h.count; ++k) {
      const Tile& t = tiles_[h.first + k];
      for (int r = 0; r < t.down; ++r) {
        const std::size_t from = (k * side + std::size_t(r)) * side;
        const std::size_t to = std::size_t(t.r0 + r - row_) * std::size_t(width_) + std::size_t(t.c0);
        put(h, from, std::size_t(t.across), to);
      }
    }
  }

 private:
  void put(const TileHeights& h, std::size_t from, std::size_t n, std::size_t to) const {
    const auto height = [&](float f) { return double(f) + h.base; };
    const auto transformed = [&](auto in, auto out, auto f) {
      if (!out.empty())
        std::transform(in.begin() + long(from), in.begin() + long(from + n), out.begin() + long(to), f);
    };
    transformed(h.height, out_.height, height);
    transformed(h.height, out_.height32, [&](float f) { return float(height(f)); });
    transformed(h.bound, out_.bound, [](float f) { return double(f); });
    for (std::size_t k = 0; k < n && !out_.bound.empty(); ++k)
      out_.bound[to + k] += VulkanBlend::departure(height(h.height[from + k]));
    transformed(h.source, out_.source, [](std::int32_t s) { return s; });
  }

  const BlendOutput& out_;
  std::span<const Tile> tiles_;
  int width_, row_;
};

// Points in groups of at most kGroup neighbours, each with the patches that may reach it.
class PointGroups {
 public:
  PointGroups(const std::vector<Blend::Placed>& placed, bool priority, std::span<const double> x,
              std::span<const double> y)
      : placed_(placed), priority_(priority), x_(x), y_(y) {}

  struct Group {
    std::span<const std::uint32_t> points;
    Candidates patches;
  };
  std::vector<Group> groups;

  void halve(std::span<std::uint32_t> points, const Candidates& from) {
    Extent e = Extent::nothing();
    for (const std::uint32_t k : points) e.add(Point{x_[k], y_[k]});
    bool inside = false;
    Candidates patches = filter(placed_, from, e.corners(), priority_, inside);
    if (points.size() <= kGroup) {
      groups.push_back({points, std::move(patches)});
      return;
    }
    const auto& along = e.xmax - e.xmin > e.ymax - e.ymin ? x_ : y_;
    // Whole groups on one side, so that few are half empty.
    const std::size_t half = (points.size() / 2 + kGroup - 1) / kGroup * kGroup;
    std::nth_element(points.begin(), points.begin() + std::ptrdiff_t(half), points.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return along[a] < along[b]; });
    halve(points.first(half), patches), halve(points.subspan(half), patches);
  }

 private:
  const std::vector<Blend::Placed>& placed_;
  bool priority_;
  std::span<const double> x_, y_;
};

// No data; what is not asked for is not written.
void forget(const BlendOutput& out, std::size_t k) {
  if (!out.height.empty()) out.height[k] = NAN;
  if (!out.height32.empty()) out.height32[k] = NAN;
  if (!out.bound.empty()) out.bound[k] = NAN;
  if (!out.source.empty()) out.source[k] = 0;
}

// The shader packs the low word first.
double double_at(std::span<const std::uint32_t> words, std::size_t at) {
  return std::bit_cast<double>(std::uint64_t{words[at]} | std::uint64_t{words[at + 1]} << 32);
}

// Groups of points as tiles: a list of patches each, no lattice.
TileBins bins_of(std::span<const PointGroups::Group> groups, const std::vector<Blend::Placed>& placed,
                 std::span<const SlotOf> slots) {
  TileBins bins;
  for (const auto& g : groups) {
    bins.tiles.push_back({std::uint32_t(bins.entries.size()),
                          std::uint32_t(g.patches.size()),
                          0,
                          {.across = int(g.points.size()), .down = 1}});
    for (const std::uint32_t k : g.patches) {
      TileEntry e{};
      e.slot = float(slots[k].slot), e.grid = float(placed[k].id.grid().value + 1);
      bins.entries.push_back(e);
    }
  }
  return bins;
}

// Points of a group go back to where they stood in the question.
void scatter(const PointGroups::Group& g, std::span<const std::uint32_t> words, std::size_t at,
             const vk::Push& push, const VulkanBlend::Impl& impl, const BlendOutput& out) {
  for (std::size_t k = 0; k < g.points.size(); ++k, ++at) {
    const std::size_t to = g.points[k];
    const std::int32_t source = impl.source_of(words[push.source_at + at]);
    if (source == 0) {
      forget(out, to);
      continue;
    }
    if (!out.height.empty()) out.height[to] = double_at(words, 2 * at);
    if (!out.height32.empty()) out.height32[to] = float(double_at(words, 2 * at));
    if (!out.bound.empty()) out.bound[to] = double_at(words, push.bound_at + 2 * at);
    if (!out.source.empty()) out.source[to] = source;
  }
}

// Submissions of groups: while one runs on the device, the results of the other are scattered.
class PointRun {
 public:
  PointRun(VulkanBlend::Impl& impl, std::span<const double> x, std::span<const double> y,
           const BlendOutput& out)
      : impl_(impl), x_(x), y_(y), out_(out) {}

  // REQUIRES: at most kBatchPoints / kGroup groups.
  void submit(std::span<const PointGroups::Group> groups) {
    std::vector<Candidates> chosen;
    for (const auto& g : groups) chosen.push_back(g.patches);
    if (!impl_.hold_chosen(chosen, groups.size() > 1)) {
      submit(groups.first(groups.size() / 2)), submit(groups.subspan(groups.size() / 2));
      return;
    }
    const TileBins bins = bins_of(groups, impl_.placed, impl_.slots);
    gather(groups);
    const std::uint32_t n = std::uint32_t(kGroup * groups.size());
    vk::Work work{.bins = &bins, .points = points_, .push = impl_.push()};  // its planes are of its own kind
    work.push.explicit_points = 1, work.push.bound_at = 2 * n, work.push.source_at = 4 * n;
    work.result_words = std::size_t{5} * n;
    const Pending now{impl_.frames[turn_ ^= 1].get(), groups, work.push};
    now.frame->submit(work);
    collect();
    pending_ = now;
  }
  void collect() {
    if (!pending_.frame) return;
    vk::Frame& frame = *pending_.frame;
    frame.finish();
    std::uint64_t points = 0;
    for (std::size_t g = 0; g < pending_.groups.size(); ++g) {
      scatter(pending_.groups[g], frame.results(), g * kGroup, pending_.push, impl_, out_);
      points += pending_.groups[g].points.size();
    }
    add(counts, frame.tally(), points);
    pending_ = {};
  }
  BlendCounts counts;

 private:
  struct Pending {
    vk::Frame* frame = nullptr;
    std::span<const PointGroups::Group> groups = {};
    vk::Push push = {};
  };
  void gather(std::span<const PointGroups::Group> groups) {
    points_.assign(2 * kGroup * groups.size(), 0);
    for (std::size_t g = 0; g < groups.size(); ++g)
      for (std::size_t k = 0; k < groups[g].points.size(); ++k) {
        const std::uint32_t from = groups[g].points[k];
        points_[2 * (kGroup * g + k)] = x_[from], points_[2 * (kGroup * g + k) + 1] = y_[from];
      }
  }
  VulkanBlend::Impl& impl_;
  std::span<const double> x_, y_;
  const BlendOutput& out_;
  std::vector<double> points_;
  Pending pending_;
  std::size_t turn_ = 0;
};

// Rows of tiles from the top; those at the right and the bottom want less than a whole one.
std::vector<Tile> tiles_of(int width, int row, int rows, int side) {
  std::vector<Tile> tiles;
  for (int r = row; r < row + rows; r += side)
    for (int c = 0; c < width; c += side)
      tiles.push_back({c, r, 1, std::min(side, width - c), std::min(side, row + rows - r)});
  return tiles;
}

}  // namespace

BlendCounts VulkanBlend::at_pixels(const RasterFrame& raster, int width, int row, int rows,
                                   const BlendOutput& out) const {
  assert(out.patch.empty());
  if (width <= 0 || rows <= 0) return {};
  const std::vector<Tile> tiles = tiles_of(width, row, rows, impl_->more.tile);
  const RasterSink sink(out, tiles, width, row);
  return impl_->run_tiles(raster, tiles, impl_->more.tile,
                          {.bound = !out.bound.empty(), .source = !out.source.empty()},
                          [&](const TileHeights& h) { sink.take(h); });
}

BlendCounts VulkanBlend::at_points(std::span<const double> x, std::span<const double> y,
                                   const BlendOutput& out) const {
  assert(out.patch.empty());
  std::vector<std::uint32_t> points(x.size());
  std::iota(points.begin(), points.end(), 0u);
  const auto finite = std::partition(points.begin(), points.end(), [&](std::uint32_t k) {
    return std::isfinite(x[k]) && std::isfinite(y[k]);
  });
  for (auto k = finite; k != points.end(); ++k) forget(out, *k);
  if (finite == points.begin()) return {.points = x.size()};
  PointGroups grouped(impl_->placed, impl_->priority(), x, y);
  Candidates all(impl_->placed.size());
  std::iota(all.begin(), all.end(), 0u);
  grouped.halve({points.begin(), finite}, all);
  const std::span<const PointGroups::Group> groups = grouped.groups;
  PointRun run(*impl_, x, y, out);
  for (std::size_t g = 0; g < groups.size(); g += kBatchPoints / kGroup)
    run.submit(groups.subspan(g, std::min(kBatchPoints / kGroup, groups.size() - g)));
  run.collect();
  run.counts.points += std::uint64_t(points.end() - finite);
  return run.counts;
}

}  // namespace patchwork
