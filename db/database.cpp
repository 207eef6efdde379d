#include "db/database.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "db/database_impl.h"
#include "db/error.h"
#include "db/surface_pool.h"

namespace patchwork {

namespace {

// Shares of the memory setting: decoded chunks, and the patches that are cut from them. Both are small:
// neighbouring points are evaluated together, and memory that is used again need not be cleared by the system
// (on a mosaic of 12 300 patches that was a third of the time).
constexpr std::size_t kChunkShare = 64, kSurfaceShare = 32;

float round_down(double v) {
  const float f = float(v);
  return double(f) > v ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float round_up(double v) {
  const float f = float(v);
  return double(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

// The samples of one patch's window, gathered from the chunks of its level.
class Window : public CellSource {
 public:
  Window(Database::Impl& db, const GridInfo& grid, int level) : db_(db), grid_(grid), level_(level) {}

  const Chunk& chunk_at(int i, int j) {
    const int cx = i / kChunkVertices, cy = j / kChunkVertices;
    if (!chunk_ || cx != cx_ || cy != cy_) chunk_ = db_.chunk(grid_, level_, cx, cy), cx_ = cx, cy_ = cy;
    return *chunk_;
  }
  // Rows and columns beyond the lattice continue it linearly, as Lattice::extrapolate_ring does.
  void fill(PatchSurface& s, int first_i, int first_j) {
    const int cols = grid_.shape.lattice_cols(level_), rows = grid_.shape.lattice_rows(level_);
    constexpr int n = PatchSurface::kSide;
    const int i0 = std::max(0, first_i), i1 = std::min(cols, first_i + n);
    const int j0 = std::max(0, first_j), j1 = std::min(rows, first_j + n);
    for (int j = j0; j < j1; ++j)
      for (int i = i0; i < i1;) {
        const Chunk& c = chunk_at(i, j);
        const int end = std::min(i1, (i / kChunkVertices + 1) * kChunkVertices);
        const std::int32_t* from =
            &c.codes[size_t(j % kChunkVertices) * size_t(c.cols) + size_t(i % kChunkVertices)];
        float* to = &s.codes[size_t((j - first_j) * n + i - first_i)];
        for (; i < end; ++i) *to++ = float(*from++);
      }
    continue_along(s.codes.data(), i0 - first_i, i1 - first_i, j0 - first_j, j1 - first_j, 1, n);
    continue_along(s.codes.data(), j0 - first_j, j1 - first_j, 0, n, n, 1);
  }
  std::uint8_t cell(int i, int j) const override {
    i = std::clamp(i, 0, grid_.shape.lattice_cols(level_) - 2);
    j = std::clamp(j, 0, grid_.shape.lattice_rows(level_) - 2);
    const Chunk& c = const_cast<Window*>(this)->chunk_at(i, j);
    if (c.cells.empty()) return CellMasks::kReal | CellMasks::kAnswering;
    return c.cells[size_t(j % kChunkVertices) * size_t(c.cols) + size_t(i % kChunkVertices)];
  }

 private:
  // Along lines of stride `step`, for lines [from, to) of stride `across`: values known in [a, b) continue
  // both ways.
  static void continue_along(float* v, int a, int b, int from, int to, int step, int across) {
    for (int line = from; line < to; ++line) {
      float* p = v + line * across;
      const float low = p[a * step], low2 = p[(a + 1) * step], high = p[(b - 1) * step],
                  high2 = p[(b - 2) * step];
      for (int m = 1; a - m >= 0; ++m) p[(a - m) * step] = low + float(m) * (low - low2);
      for (int m = 1; b - 1 + m < PatchSurface::kSide; ++m)
        p[(b - 1 + m) * step] = high + float(m) * (high - high2);
    }
  }
  Database::Impl& db_;
  const GridInfo& grid_;
  int level_;
  std::shared_ptr<const Chunk> chunk_;
  int cx_ = -1, cy_ = -1;
};

}  // namespace

LodBox lod_box(const Grid& grid, std::size_t index) {
  const GridShape::Block b = grid.info.shape.block(index);
  const Extent e = grid.info.frame.bounds(grid.info.shape.domain(b.level, b.bx, b.by));
  const PatchRecord& p = grid.patches[index];
  return {e.xmin, e.ymin, e.xmax, e.ymax, p.best() ? 0.f : round_down(p.bottom), round_up(p.top)};
}

Database::Impl::Impl(Store opened, std::size_t memory)
    : store(std::move(opened)), chunks(memory / kChunkShare), surfaces(memory / kSurfaceShare) {}

void Database::Impl::load() {
  crs = store.fact("crs").value_or("");
  grids.clear();
  for (GridInfo& info : store.grids()) {
    Grid g{std::move(info), {}, {}};
    g.patches = store.patches(g.info);
    if (g.info.holes) g.offers = store.offers(g.info);
    grids.push_back(std::move(g));
  }
  counts = {};
  const auto count = [&](const char* key) { return std::stoull(store.fact(key).value_or("0")); };
  counts = {count("decided_integer"), count("decided_interval"), count("decided_exact")};
  const auto stored = store.tree_pages();
  if (stored.empty()) {
    tree = LodTree();
    return;
  }
  std::vector<LodTree::StoredPage> pages;
  for (const auto& [id, bytes] : stored)
    if (id >= kFirstTreePage) pages.push_back({id - kFirstTreePage, bytes});
  tree = LodTree::from_pages(stored.front().second, pages);
}

std::shared_ptr<const Chunk> Database::Impl::chunk(const GridInfo& grid, int level, int cx, int cy) {
  const std::uint64_t key = PatchId::make(grid.id, level, cx, cy).value;
  return chunks.get(key, sizeof(std::int32_t) * kChunkVertices * kChunkVertices, [&] {
    std::optional<Bytes> bytes;
    {
      const std::lock_guard lock(store_mutex);
      bytes = store.payload(grid.id, level, cx, cy);
    }
    auto chunk = std::make_shared<Chunk>(make_chunk(grid.shape, level, cx, cy));
    const std::string bad = bytes ? decode_chunk(*bytes, *chunk) : "a payload chunk is missing";
    if (!bad.empty()) throw Error(store.path(), grid.name + ": " + bad, "restore the file from a copy");
    return chunk;
  });
}

std::size_t Database::Impl::place(GridId id) const {
  const auto it = std::lower_bound(grids.begin(), grids.end(), id,
                                   [](const Grid& g, GridId wanted) { return g.info.id < wanted; });
  if (it == grids.end() || it->info.id != id)
    throw Error(store.path(), "the R-tree names a grid that is not there");
  return size_t(it - grids.begin());
}

Database::Database(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Database::Database(Database&&) noexcept = default;
Database& Database::operator=(Database&&) noexcept = default;
Database::~Database() = default;

Database Database::open(const std::string& path, std::size_t memory) {
  Database db(std::make_unique<Impl>(Store::open(path, Store::Mode::read), memory));
  db.impl_->store.begin_read();
  db.impl_->load();
  return db;
}

Database Database::open_or_create(const std::string& path, const std::string& crs, std::size_t memory) {
  Database db(std::make_unique<Impl>(Store::open(path, Store::Mode::create), memory));
  Store& store = db.impl_->store;
  store.begin_write();
  const std::string known = store.fact("crs").value_or("");
  if (known.empty() && !crs.empty() && store.grids().empty()) store.set_fact("crs", crs);
  store.commit();
  db.impl_->load();
  return db;
}

const std::string& Database::path() const { return impl_->store.path(); }
const std::string& Database::crs() const { return impl_->crs; }
std::span<const Grid> Database::grids() const { return impl_->grids; }
const Grid& Database::grid(GridId id) const { return impl_->grids[impl_->place(id)]; }
const PatchRecord& Database::patch(PatchId id) const {
  return grid(id.grid()).at(id.level(), id.bx(), id.by());
}
const LodTree& Database::tree() const { return impl_->tree; }
CoverageCounts Database::coverage_counts() const { return impl_->counts; }
std::uint64_t Database::file_bytes() const { return impl_->store.file_bytes(); }

Extent Database::extent() const {
  Extent all{INFINITY, INFINITY, -INFINITY, -INFINITY};
  for (const Grid& g : impl_->grids) {
    const Extent e = g.info.frame.bounds(g.info.shape.footprint());
    all = {std::min(all.xmin, e.xmin), std::min(all.ymin, e.ymin), std::max(all.xmax, e.xmax),
           std::max(all.ymax, e.ymax)};
  }
  return all;
}

std::uint64_t Database::sample_bytes() const {
  std::uint64_t sum = 0;
  for (const Grid& g : impl_->grids)
    sum += std::uint64_t(g.info.shape.width()) * std::uint64_t(g.info.shape.height()) *
           std::uint64_t(g.info.sample_bytes);
  return sum;
}

std::string Database::content_hash() const {
  std::vector<const Grid*> order;
  for (const Grid& g : impl_->grids) order.push_back(&g);
  std::sort(order.begin(), order.end(),
            [](const Grid* a, const Grid* b) { return a->info.digest < b->info.digest; });
  XXH3_state_t* state = XXH3_createState();
  XXH3_128bits_reset(state);
  for (const Grid* g : order) {  // a digest covers the grid's samples, of which the stored levels are made
    XXH3_128bits_update(state, g->info.digest.data(), g->info.digest.size());
    XXH3_128bits_update(state, g->patches.data(), g->patches.size() * sizeof(PatchRecord));
    XXH3_128bits_update(state, g->offers.data(), g->offers.size() * sizeof(Offer));
  }
  const XXH128_hash_t h = XXH3_128bits_digest(state);
  XXH3_freeState(state);
  return fmt::format("{:016x}{:016x}", h.high64, h.low64);
}

std::shared_ptr<const PatchSurface> Database::surface(PatchId id) const {
  return impl_->surfaces.get(id.value, sizeof(PatchSurface), [&] {
    const Grid& g = grid(id.grid());
    const int level = id.level(), first_i = id.bx() * kKernelCells - kExtensionCells - 1,
              first_j = id.by() * kKernelCells - kExtensionCells - 1;
    auto s =
        std::allocate_shared<PatchSurface>(std::pmr::polymorphic_allocator<PatchSurface>(&surface_pool()));
    s->id = id, s->level = level, s->first_i = first_i, s->first_j = first_j;
    s->kernel = g.info.shape.kernel(level, id.bx(), id.by());
    s->domain = g.info.shape.domain(level, id.bx(), id.by());
    Window window(*impl_, g.info, level);
    window.fill(*s, first_i, first_j);
    if (patch(id).ragged()) s->holes = make_holes(window, level, id.bx(), id.by());
    return s;
  });
}

}  // namespace patchwork
