// Several files as tiles of one grid: they are placed on the first one's lattice and read through it.
#include <algorithm>
#include <climits>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "db/raster_impl.h"

namespace patchwork::raster_impl {

namespace {

// Tiles of one survey may differ by the rounding of their printed origins and steps, not by more.
constexpr double kStepTolerance = 1e-9, kCellTolerance = 1e-3;

struct Tile {
  RawGrid grid;
  int i = 0, j = 0;  // of its first sample in the joined grid
  int right() const { return i + grid.width; }
  int bottom() const { return j + grid.height; }
};

class JoinedRows final : public Rows {
 public:
  JoinedRows(std::vector<Tile> tiles, int width) : tiles_(std::move(tiles)), width_(width) {}
  void read(int row, int rows, double* out) override { read_as(row, rows, out); }
  void read(int row, int rows, float* out) override { read_as(row, rows, out); }

 private:
  // The tiles from the last to the first, so that an earlier one's heights stand; its holes let others
  // through.
  template <typename T>
  void read_as(int row, int rows, T* out) {
    const auto stride = static_cast<std::size_t>(width_);
    std::fill_n(out, stride * static_cast<std::size_t>(rows), std::numeric_limits<T>::quiet_NaN());
    std::vector<T> buffer;
    for (auto tile = tiles_.rbegin(); tile != tiles_.rend(); ++tile) {
      const int from = std::max(row, tile->j), to = std::min(row + rows, tile->bottom());
      if (from >= to) continue;
      const auto w = static_cast<std::size_t>(tile->grid.width);
      buffer.resize(w * static_cast<std::size_t>(to - from));
      tile->grid.rows->read(from - tile->j, to - from, buffer.data());
      for (int r = from; r < to; ++r)
        overlay(buffer.data() + w * static_cast<std::size_t>(r - from), w,
                out + stride * static_cast<std::size_t>(r - row) + tile->i);
    }
  }

  template <typename T>
  static void overlay(const T* from, std::size_t count, T* to) {
    for (std::size_t k = 0; k < count; ++k) to[k] = std::isnan(from[k]) ? to[k] : from[k];
  }

  std::vector<Tile> tiles_;
  int width_;
};

void refuse(const RawGrid& tile, const RawGrid& first, const std::string& what) {
  throw Error(tile.path, what + " differs from that of " + first.path, "import it without --join");
}

void check_alike(const RawGrid& tile, const RawGrid& first) {
  if (tile.type != first.type) refuse(tile, first, "its sample type");
  if (tile.scale != first.scale || tile.offset != first.offset)
    refuse(tile, first, "its unit, scale or offset");
  if (tile.pixel_is_area != first.pixel_is_area) refuse(tile, first, "its registration (area or point)");
  if (tile.crs.has_value() != first.crs.has_value() || (tile.crs && !same_crs(*tile.crs, *first.crs)))
    refuse(tile, first, "its CRS");
  if (tile.nodata != first.nodata)
    throw Error(tile.path, "its nodata value differs from that of " + first.path, "give both with --nodata");
}

// The tile's first sample in cells of the first tile's lattice.
void place(Tile& tile, const RawGrid& first) {
  const Frame base = first.frame(), own = tile.grid.frame();
  for (const int k : {1, 2, 4, 5}) {
    const double step = k == 1 || k == 4 ? base.step_i() : base.step_j();
    if (!(std::abs(own.numbers()[static_cast<std::size_t>(k)] -
                   base.numbers()[static_cast<std::size_t>(k)]) <= kStepTolerance * step))
      refuse(tile.grid, first, "its steps or rotation");
  }
  const Point p = own.to_domain(0, 0), cell = base.to_lattice(p.x, p.y);
  const double i = std::round(cell.x), j = std::round(cell.y);
  if (!(std::max(std::abs(cell.x - i), std::abs(cell.y - j)) <= kCellTolerance))
    throw Error(tile.grid.path, "does not lie a whole number of cells from " + first.path,
                "import it without --join");
  if (!(std::max(std::abs(i), std::abs(j)) < INT_MAX / 4))
    throw Error(tile.grid.path, "lies too far from " + first.path + " to be joined",
                "import it without --join");
  tile.i = static_cast<int>(i);
  tile.j = static_cast<int>(j);
}

// Moves the tiles so that the joined grid begins at (0, 0), and says where that is.
void set_origin(std::vector<Tile>& tiles, RawGrid& joined) {
  int i0 = 0, j0 = 0;
  for (const Tile& t : tiles) {
    i0 = std::min(i0, t.i);
    j0 = std::min(j0, t.j);
  }
  for (Tile& t : tiles) {
    t.i -= i0;
    t.j -= j0;
    joined.width = std::max(joined.width, t.right());
    joined.height = std::max(joined.height, t.bottom());
  }
  auto& gt = joined.geotransform;
  gt[0] += gt[1] * i0 + gt[2] * j0;
  gt[3] += gt[4] * i0 + gt[5] * j0;
}

// The largest difference between two tiles' samples where they overlap, raw units.
double overlap_difference(Tile& a, Tile& b) {
  const int i0 = std::max(a.i, b.i), i1 = std::min(a.right(), b.right());
  double largest = 0;
  if (i0 >= i1) return largest;
  std::vector<double> of_a(static_cast<std::size_t>(a.grid.width)),
      of_b(static_cast<std::size_t>(b.grid.width));
  for (int j = std::max(a.j, b.j); j < std::min(a.bottom(), b.bottom()); ++j) {
    a.grid.rows->read(j - a.j, 1, of_a.data());
    b.grid.rows->read(j - b.j, 1, of_b.data());
    for (int i = i0; i < i1; ++i) {
      const double d =
          std::abs(of_a[static_cast<std::size_t>(i - a.i)] - of_b[static_cast<std::size_t>(i - b.i)]);
      if (d > largest) largest = d;
    }
  }
  return largest;
}

void compare_overlaps(std::vector<Tile>& tiles, RawGrid& joined) {
  double largest = 0;
  for (std::size_t b = 1; b < tiles.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) largest = std::max(largest, overlap_difference(tiles[a], tiles[b]));
  if (largest == 0) return;
  char text[120];
  std::snprintf(text, sizeof text,
                "its tiles differ by up to %.6g m where they overlap: the earlier file is taken",
                largest * std::abs(joined.scale));
  joined.warnings.push_back(text);
}

}  // namespace

RawGrid join_raw(const std::vector<std::string>& paths, const RasterOptions& options) {
  std::vector<Tile> tiles;
  for (const std::string& path : paths) {
    tiles.push_back(Tile{open_raw(path, options), 0, 0});
    check_alike(tiles.back().grid, tiles.front().grid);
    place(tiles.back(), tiles.front().grid);
  }
  RawGrid joined;
  const RawGrid& first = tiles.front().grid;
  joined.path = first.path;
  joined.geotransform = first.geotransform;
  joined.pixel_is_area = first.pixel_is_area;
  joined.crs = first.crs;
  joined.type = first.type;
  joined.nodata = first.nodata;
  joined.scale = first.scale;
  joined.offset = first.offset;
  joined.warnings = first.warnings;
  set_origin(tiles, joined);
  compare_overlaps(tiles, joined);
  joined.rows = std::make_unique<JoinedRows>(std::move(tiles), joined.width);
  return joined;
}

}  // namespace patchwork::raster_impl
