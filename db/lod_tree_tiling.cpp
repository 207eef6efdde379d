#include "db/lod_tree_tiling.h"

#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace patchwork {

namespace {

// What a page is taken to cost: how likely a question reads it, by its box. Of the questions, one in five
// asks for an error, any octave alike, over a square of a tenth of the extent; the others are views from
// anywhere, which allow kNearest times the distance from the eye, or a power of kNext times as much.
constexpr double kUniform = 0.2, kSide = 0.1;
constexpr double kNearest = 0x1p-10, kNext = 4;
constexpr int kSlopes = 4;

// A box to be tiled: the box; by what it may be sorted (centre in x and y, metres from the corner of all
// boxes; middle, top and bottom of its errors, octaves); and which entry it is.
struct Tile {
  static constexpr std::size_t kKeys = 5;
  LodBox box;
  std::array<float, kKeys> keys;
  std::uint32_t index;
};

class Tiling {
 public:
  explicit Tiling(const std::vector<LodEntry>& entries) {
    LodBox all = entries[0].box;
    for (const LodEntry& e : entries) all = united(all, e.box);
    width_ = all.xmax - all.xmin, height_ = all.ymax - all.ymin;
    tiles_.reserve(entries.size());
    for (const LodEntry& e : entries) {
      const LodBox& b = e.box;
      const float low = error_octaves(b.bottom), high = error_octaves(b.top);
      lowest_ = std::min(lowest_, high), highest_ = std::max(highest_, std::isfinite(b.top) ? high : low);
      tiles_.push_back({b,
                        {float(0.5 * (b.xmin + b.xmax) - all.xmin), float(0.5 * (b.ymin + b.ymax) - all.ymin),
                         0.5f * (low + high), high, low},
                        std::uint32_t(tiles_.size())});
    }
  }

  using Done = std::function<void(std::span<const std::uint32_t>)>;
  void split(std::size_t pages, const Done& done) {
    std::vector<std::span<const Tile>> parts(pages);
    split(std::span<Tile>(tiles_), std::span(parts));
    std::vector<std::uint32_t> part;
    for (const std::span<const Tile> tiles : parts) {
      part.clear();
      for (const Tile& t : tiles) part.push_back(t.index);
      done(part);
    }
  }

 private:
  static constexpr std::size_t kWorthAThread = 4096;  // tiles
  // Greedy from the top (Garcia, Lopez and Leutenegger 1998, "A greedy algorithm for bulk loading R-trees"),
  // with a cost that knows cuts: of the ways to part the tiles in two, along each key and at each of three
  // shares, the one whose parts cost least.
  void split(std::span<Tile> tiles, std::span<std::span<const Tile>> parts) const {
    const std::size_t pages = parts.size();
    if (pages == 1) parts[0] = tiles;
    if (pages <= 1) return;
    double least = INFINITY;
    std::size_t key = 0, first = pages / 2;  // where no cost is a number
    for (std::size_t k = 0; k < Tile::kKeys; ++k)
      for (const double share : {0.5, 0.25, 0.75}) {
        const auto part = std::clamp<std::size_t>(std::size_t(share * double(pages) + 0.5), 1, pages - 1);
        const std::size_t cut = part_by(tiles, k, part, pages);
        const double cost = double(part) * this->cost(tiles.first(cut)) +
                            double(pages - part) * this->cost(tiles.subspan(cut));
        if (cost < least) least = cost, key = k, first = part;
        if (pages == 2) break;
      }
    const std::size_t cut = part_by(tiles, key, first, pages);
    const auto one = [&] { split(tiles.first(cut), parts.first(first)); };
    const auto other = [&] { split(tiles.subspan(cut), parts.subspan(first)); };
    if (tiles.size() < kWorthAThread)
      one(), other();
    else
      tbb::parallel_invoke(one, other);
  }

  // The tiles of the first `part` pages of `pages`, by a key, to the front; returns how many.
  static std::size_t part_by(std::span<Tile> tiles, std::size_t key, std::size_t part, std::size_t pages) {
    const std::size_t cut = tiles.size() * part / pages;
    std::nth_element(tiles.begin(), tiles.begin() + std::ptrdiff_t(cut), tiles.end(),
                     [key](const Tile& a, const Tile& b) {
                       return a.keys[key] != b.keys[key] ? a.keys[key] < b.keys[key] : a.index < b.index;
                     });
    return cut;
  }

  double cost(std::span<const Tile> tiles) const {
    LodBox b = tiles[0].box;
    for (const Tile& t : tiles) b = united(b, t.box);
    const double extent = width_ * height_ + 1e-9;
    const double w = b.xmax - b.xmin, h = b.ymax - b.ymin;
    const double octaves =
        double(std::min(error_octaves(b.top), highest_) - std::max(error_octaves(b.bottom), lowest_ - 1));
    const double uniform = std::min(1.0, (w + kSide * width_) * (h + kSide * height_) / extent) *
                           std::max(0.0, octaves) / double(highest_ - lowest_ + 1);
    double views = 0, slope = kNearest;
    for (int n = 0; n < kSlopes; ++n, slope *= kNext) {
      // Where the eye may be: near enough for the smallest error, not so near that the largest is too much.
      const double far = std::min(double(b.top) / slope, 2 * (width_ + height_));
      const double near = std::max(0.0, double(b.bottom) / slope - 0.5 * std::hypot(w, h));
      const double reached = std::min(extent, w * h + 2 * (w + h) * far + M_PI * far * far);
      views += std::max(0.0, reached - M_PI * near * near) / extent / kSlopes;
    }
    return kUniform * uniform + (1 - kUniform) * views;
  }

  std::vector<Tile> tiles_;
  double width_ = 0, height_ = 0;                  // metres, of all boxes
  float lowest_ = INFINITY, highest_ = -INFINITY;  // octaves: of the tops, of finite ones
};

}  // namespace

void tile(const std::vector<LodEntry>& entries, std::size_t pages,
          const std::function<void(std::span<const std::uint32_t>)>& done) {
  Tiling(entries).split(pages, done);
}

}  // namespace patchwork
