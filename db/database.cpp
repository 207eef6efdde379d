#include "db/database.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "db/cell_masks.h"
#include "db/database_impl.h"
#include "db/digest.h"
#include "db/error.h"
#include "db/float_rounding.h"
#include "db/surface_pool.h"

namespace patchwork {

namespace {

// Shares of the memory setting: decoded chunks, and the patches that are cut from them. Both are small:
// neighbouring points are evaluated together, and memory that is used again need not be cleared by the system
// (on a mosaic of 12 300 patches that was a third of the time).
// The structure's share, a quarter, holds the records and tree pages of 10^9 samples.
constexpr std::size_t kChunkShare = 64, kSurfaceShare = 32, kStructureShare = 4;
constexpr const char* kRemark = "remark ";  // before the names of remarks among the store's facts
constexpr const char* kRestore =
    "see: patchwork check; restore the file from a copy, or import the grid again";
constexpr const char* kRepair = "run: patchwork check --repair, which makes it from the patches";
constexpr std::uint64_t kUnknown = std::numeric_limits<std::uint64_t>::max();  // a version that no store has

// A number among a store's facts, 0 where it is not there.
std::uint64_t number(Store& store, const std::string& fact) {
  const std::string text = store.fact(fact).value_or("0");
  std::uint64_t n = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (problem != std::errc() || end != text.data() + text.size())
    throw Error(store.path(), "its fact " + fact + " is damaged: " + text, kRestore);
  return n;
}

// The samples of one patch's window, gathered from the chunks of its level.
class Window : public CellSource {
 public:
  Window(Database::Impl& db, const GridInfo& grid, int level) : db_(db), grid_(grid), level_(level) {}

  const Chunk& chunk_at(int i, int j) {
    const int cx = i / kChunkVertices, cy = j / kChunkVertices;
    Held& h = held_[size_t(cy % 2 * 2 + cx % 2)];
    if (!h.chunk || h.cx != cx || h.cy != cy) h = {db_.chunk(grid_, level_, cx, cy), cx, cy};
    return *h.chunk;
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
  void row(int first, int j, std::span<std::uint8_t> out) const override {
    const int last = grid_.shape.lattice_cols(level_) - 2;
    j = std::clamp(j, 0, grid_.shape.lattice_rows(level_) - 2);
    for (std::uint8_t& to : out) {
      const int i = std::clamp(first++, 0, last);
      const Chunk& c = const_cast<Window*>(this)->chunk_at(i, j);
      to = c.cells.empty()
               ? CellMasks::kReal | CellMasks::kAnswering
               : c.cells[size_t(j % kChunkVertices) * size_t(c.cols) + size_t(i % kChunkVertices)];
    }
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
  // A window is smaller than a chunk, so it meets at most four.
  struct Held {
    std::shared_ptr<const Chunk> chunk;
    int cx = 0, cy = 0;
  };
  std::array<Held, 4> held_;
};

}  // namespace

LodBox lod_box(const GridInfo& grid, std::size_t index, const PatchRecord& patch) {
  const GridShape::Block b = grid.shape.block(index);
  const Extent e = grid.frame.bounds(grid.shape.domain(b.level, b.bx, b.by));
  const float bottom = patch.best() ? 0.f : float_at_most(patch.bottom);
  return {e.xmin, e.ymin, e.xmax, e.ymax, bottom, float_at_least(patch.top)};
}

Database::Impl::Impl(std::unique_ptr<Store> opened, std::size_t memory)
    : store(std::move(opened)),
      structure_share(memory / kStructureShare),
      chunks(memory / kChunkShare),
      surfaces(memory / kSurfaceShare) {}

std::optional<Bytes> Database::Impl::blob(Store::Kind kind, std::uint64_t key) {
  const std::lock_guard lock(store_mutex);
  return store->blob(kind, key);
}

PatchRecords Database::Impl::stored_records(const GridInfo& grid) {
  const std::size_t patches = grid.shape.blocks();
  return PatchRecords(patches, [this, patches, id = grid.id, name = grid.name](std::size_t run) {
    const auto bytes = blob(Store::Kind::records, first_key(id) | run);
    if (!bytes) throw Error(store->path(), "patch records of " + name + " are missing", kRestore);
    std::string problem;
    auto made = std::make_unique<RecordRun>(RecordRun::from_bytes(*bytes, run, patches, problem));
    if (!problem.empty())
      throw Error(store->path(), "a run of patch records of " + name + " " + problem, kRestore);
    ++runs_read;
    return made;
  });
}

void Database::Impl::load() {
  try {
    read_state();
  } catch (const Error& e) {  // what was read before is no state of the store any more
    std::set<GridId> all;
    for (const Grid& g : grids) all.insert(g.info.id);
    forget_heights(all);
    version = kUnknown, grids.clear(), tree = LodTree(), tree_damage = e;
    throw;
  }
}

void Database::Impl::read_state() {
  const std::uint64_t there = number(*store, "version");
  const CoverageCounts decided{number(*store, "decided_integer"), number(*store, "decided_interval"),
                               number(*store, "decided_exact")};
  std::string new_crs = store->fact("crs").value_or("");
  std::vector<Grid> now;
  for (GridInfo& info : store->grids()) {
    PatchRecords records = stored_records(info);
    now.push_back({std::move(info), std::move(records)});
  }
  std::set<GridId> gone;  // their ids are given to other grids again
  for (const Grid& old : grids)
    if (std::none_of(now.begin(), now.end(), [&](const Grid& g) {
          return g.info.id == old.info.id && g.info.digest == old.info.digest;
        }))
      gone.insert(old.info.id);
  forget_heights(gone);
  version = there, counts = decided, crs = std::move(new_crs), grids = std::move(now), runs_read = 0;
  tree = LodTree(), tree_damage.reset();
  try {
    const auto header = store->blob(Store::Kind::tree_page, 0);
    if (header)
      tree = LodTree::open(*header, [this](std::uint32_t page) {
        const auto bytes = blob(Store::Kind::tree_page, tree_page_key(page));
        if (!bytes) throw Error(store->path(), "a page of the R-tree is missing", kRepair);
        return *bytes;
      });
    if (!header && !grids.empty()) throw Error(store->path(), "the R-tree is missing", kRepair);
  } catch (const Error& e) {
    tree_damage = e;
  }
}

void Database::Impl::forget_heights(const std::set<GridId>& gone) {
  if (gone.empty()) return;
  const auto of_gone = [&](std::uint64_t key) { return gone.contains(PatchId{key}.grid()); };
  chunks.erase_if(of_gone), surfaces.erase_if(of_gone);
}

void Database::Impl::change(const std::function<bool()>& work) {
  store->rollback();
  const auto settle = [&](bool keep) {
    const std::uint64_t mine = version;
    store->begin_read();
    if (!keep || number(*store, "version") != mine) load();
  };
  try {
    store->begin_write();
    load();  // another process may have written since this one looked
    const bool keep = work();
    keep ? store->commit() : store->rollback();
    settle(keep);
  } catch (...) {
    store->rollback();
    try {
      settle(false);
    } catch (const Error&) {  // the first problem is the one to be told
    }
    throw;
  }
}

void Database::Impl::trim() {
  const auto used = [&] {
    return tree.loaded_pages() * sizeof(LodPage) + runs_read * RecordRun::kRecords * sizeof(PatchRecord);
  };
  if (used() <= structure_share) return;
  const std::unique_lock alone(structure, std::try_to_lock);
  if (!alone || used() <= structure_share) return;
  tree.drop_pages();
  for (Grid& g : grids) g.patches.runs().drop_unchanged();
  runs_read = 0;
}

std::shared_ptr<const Chunk> Database::Impl::chunk(const GridInfo& grid, int level, int cx, int cy) {
  const std::uint64_t key = PatchId::make(grid.id, level, cx, cy).value;
  return chunks.get(key, sizeof(std::int32_t) * kChunkVertices * kChunkVertices, [&] {
    std::shared_ptr<const Chunk> parent;  // what this one was predicted from
    if (level + 1 < grid.shape.levels()) parent = this->chunk(grid, level + 1, cx / 2, cy / 2);
    const std::optional<Bytes> bytes = blob(Store::Kind::payload, key);
    auto chunk = std::make_shared<Chunk>(make_chunk(grid.shape, level, cx, cy));
    const std::string bad =
        bytes ? decode_chunk(*bytes, *chunk, parent.get(), cx, cy) : "a payload chunk is missing";
    if (!bad.empty()) throw Error(store->path(), grid.name + ": " + bad, kRestore);
    return chunk;
  });
}

std::size_t Database::Impl::place(GridId id) const {
  const auto it = std::lower_bound(grids.begin(), grids.end(), id,
                                   [](const Grid& g, GridId wanted) { return g.info.id < wanted; });
  if (it == grids.end() || it->info.id != id)
    throw Error(store->path(), "the R-tree names a grid that is not there", kRepair);
  return size_t(it - grids.begin());
}

std::size_t Database::Impl::place(const std::string& name) const {
  for (std::size_t g = 0; g < grids.size(); ++g)
    if (grids[g].info.name == name) return g;
  throw Error(store->path(), "it has no grid named " + name, "see: patchwork list DB");
}

Database::Database(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Database::Database(Database&&) noexcept = default;
Database& Database::operator=(Database&&) noexcept = default;
Database::~Database() = default;

Database Database::in_mode(StoreMode mode, const std::string& path, std::size_t memory) {
  Database db(std::make_unique<Impl>(open_store(path, mode), memory));
  db.impl_->store->begin_read();
  db.impl_->load();
  return db;
}

Database Database::open(const std::string& path, std::size_t memory) {
  return in_mode(StoreMode::read, path, memory);
}

Database Database::open_existing(const std::string& path, std::size_t memory) {
  return in_mode(StoreMode::write, path, memory);
}

Database Database::open_or_create(const std::string& path, const std::string& crs, std::size_t memory) {
  Database db(std::make_unique<Impl>(open_store(path, StoreMode::create), memory));
  Store& store = *db.impl_->store;
  const auto free = [&] { return store.fact("crs").value_or("").empty() && store.grids().empty(); };
  if (!crs.empty() && free()) {
    store.begin_write();
    if (free()) store.set_fact("crs", crs);
    store.commit();
  }
  store.begin_read();
  db.impl_->load();
  return db;
}

bool Database::made_file() const { return impl_->store->made_file(); }

void Database::remove_if_empty() {
  Store& store = *impl_->store;
  store.rollback();
  try {
    store.begin_write();
    if (store.grids().empty()) store.remove_file();
    store.rollback();
  } catch (const Error&) {
    return;  // it is in use
  }
}

bool Database::refresh() {
  Store& store = *impl_->store;
  const std::uint64_t before = impl_->version;
  store.rollback();
  store.begin_read();
  if (number(store, "version") == before) return false;
  impl_->load();
  return true;
}

bool Database::is_newest() const {
  std::unique_ptr<Store>& watch = impl_->watch;
  if (!watch) watch = open_store(path(), StoreMode::read);
  watch->rollback();  // of a question that failed
  watch->begin_read();
  const std::uint64_t newest = number(*watch, "version");
  watch->rollback();
  return newest == version();
}

Database::Reading Database::reading() const {
  impl_->trim();
  return Reading(impl_->structure);
}

const std::string& Database::path() const { return impl_->store->path(); }
std::uint64_t Database::version() const { return impl_->version; }
std::vector<Change> Database::changed_since(std::uint64_t version) const {
  const std::lock_guard lock(impl_->store_mutex);
  return impl_->store->changes_after(version);
}
const std::string& Database::crs() const { return impl_->crs; }
std::span<const Grid> Database::grids() const { return impl_->grids; }
const Grid& Database::grid(GridId id) const { return impl_->grids[impl_->place(id)]; }
const Grid& Database::grid(const std::string& name) const { return impl_->grids[impl_->place(name)]; }
PatchRecord Database::patch(PatchId id) const {
  const Reading reading = this->reading();
  return grid(id.grid()).at(id.level(), id.bx(), id.by());
}
const LodTree& Database::tree() const {
  if (impl_->tree_damage) throw Error(*impl_->tree_damage);
  return impl_->tree;
}
CoverageCounts Database::coverage_counts() const { return impl_->counts; }
std::uint64_t Database::file_bytes() const { return impl_->store->file_bytes(); }

Extent Database::extent() const {
  Extent all = Extent::nothing();
  for (const Grid& g : impl_->grids) all.add(g.info.bounds());
  return all;
}

HeightRange Database::heights() const {
  HeightRange all;
  for (const Grid& g : impl_->grids) all.add({g.info.lowest, g.info.highest});
  return all;
}

double Database::coarsest_bottom() const {
  const Reading reading = this->reading();
  double most = 0;
  for (const Grid& g : impl_->grids)
    if (g.patches.size() > 0) most = std::max(most, g.patches[g.patches.size() - 1].bottom);
  return most;
}

std::uint64_t Database::sample_bytes() const {
  std::uint64_t sum = 0;
  for (const Grid& g : impl_->grids)
    sum += std::uint64_t(g.info.shape.width()) * std::uint64_t(g.info.shape.height()) *
           std::uint64_t(g.info.sample_bytes);
  return sum;
}

std::string Database::content_hash() const {
  const Reading reading = this->reading();
  std::vector<const Grid*> order;
  for (const Grid& g : impl_->grids) order.push_back(&g);
  std::sort(order.begin(), order.end(),
            [](const Grid* a, const Grid* b) { return a->info.digest < b->info.digest; });
  DigestBuilder digest;
  for (const Grid* g : order) {  // a digest covers the grid's samples, of which the stored levels are made
    digest.add(g->info.digest.data(), g->info.digest.size());
    g->patches.runs().each([&](const RecordRun& run) {
      digest.add(run.records.data(), run.records.size());
      digest.add(run.offers.data(), run.offers.size());
    });
  }
  std::string hex;
  for (const std::uint8_t byte : digest.get()) hex += fmt::format("{:02x}", byte);
  return hex;
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
    if (g.info.holes && patch(id).ragged()) s->holes = make_holes(window, level, id.bx(), id.by());
    return s;
  });
}

std::optional<std::string> Database::remark(const std::string& name) const {
  const std::lock_guard lock(impl_->store_mutex);
  return impl_->store->fact(kRemark + name);
}

void Database::keep_remark(const std::string& name, const std::string& text) {
  impl_->change([&] { return impl_->store->set_fact(kRemark + name, text), true; });
}

void Database::read_samples(GridId id, int row, int rows, std::span<double> out) const {
  const GridInfo& g = grid(id).info;
  const int width = g.shape.width();
  const double raw_quantum = g.quantum / g.raw_scale;  // exact: a power of two where storage is lossless
  // Column by column of chunks: each is decoded once, however wide the grid.
  tbb::parallel_for(0, (width + kChunkVertices - 1) / kChunkVertices, [&](int cx) {
    const int first = cx * kChunkVertices, end = std::min(width, first + kChunkVertices);
    std::shared_ptr<const Chunk> c;
    for (int j = row; j < row + rows; ++j) {
      if (!c || j % kChunkVertices == 0) c = impl_->chunk(g, 0, cx, j / kChunkVertices);
      for (int i = first; i < end; ++i) {
        const auto at = size_t(j % kChunkVertices) * size_t(c->cols) + size_t(i - first);
        const bool valid = c->cells.empty() || (c->cells[at] & CellMasks::kVertex);
        out[size_t(j - row) * size_t(width) + size_t(i)] =
            valid ? raw_quantum * (double(g.code_origin) + c->codes[at]) : std::nan("");
      }
    }
  });
}

}  // namespace patchwork
