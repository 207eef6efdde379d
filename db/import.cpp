// A grid's way into the database: bands to payloads and errors, errors to records, records to tops, all in
// one transaction.
#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "db/database_impl.h"
#include "db/digest.h"
#include "db/error.h"
#include "db/patch_errors.h"
#include "db/restate.h"
#include "db/stopwatch.h"

namespace patchwork {

namespace {

constexpr double kRimFactor =
    0.375;  // (t^2 + t) / 2 at half a cell: what a second difference makes of extrapolation
constexpr int kTaskRows = kChunkVertices;

class MaskCells : public CellSource {
 public:
  MaskCells(const CellMasks& masks, int level) : masks_(masks), level_(level) {}
  std::uint8_t cell(int i, int j) const {
    return masks_.at(level_, std::clamp(i, 0, masks_.cols(level_) - 1),
                     std::clamp(j, 0, masks_.rows(level_) - 1));
  }
  void row(int i, int j, std::span<std::uint8_t> out) const override {
    const int n = int(out.size()), cols = masks_.cols(level_);
    const int first = std::clamp(-i, 0, n), end = std::clamp(cols - i, first, n);
    std::fill_n(out.begin(), first, cell(0, j));
    std::copy_n(masks_.row(level_, std::clamp(j, 0, masks_.rows(level_) - 1)) + (i + first), end - first,
                out.begin() + first);
    std::fill(out.begin() + end, out.end(), cell(cols - 1, j));
  }

 private:
  const CellMasks& masks_;
  int level_;
};

class Importer {
 public:
  Importer(Database::Impl& db, const RasterSource& source, const ImportOptions& options)
      : db_(db),
        options_(options),
        source_(source),
        ingest_(std::in_place, source, options.memory, options.tolerance,
                [&](double share) { say(0.2 * share); }),
        errors_(std::in_place, ingest_->shape(), ingest_->masks()) {
    report_.seconds.scan += watch_.lap();
  }

  ImportReport run() {
    describe();
    for (int y = 0; y < shape().height(); y += ingest_->band_rows()) {
      const Ingest::Band band = ingest_->read_band(y, std::min(shape().height(), y + ingest_->band_rows()));
      report_.seconds.scan += watch_.lap();
      digest(band);
      measure(band);
      report_.seconds.errors += watch_.lap();
      for (const Lattice& l : band.levels) encode(l, band.y0 >> l.level(), chunk_end(l, band.y1), &band);
      say(0.2 + 0.7 * double(band.y1) / shape().height());
    }
    for (int l = Ingest::kStreamedLevels; l < shape().levels(); ++l)
      encode(ingest_->coarse(l), 0, shape().lattice_rows(l), nullptr);
    report_.seconds.encode += watch_.lap();
    finish_grid();
    if (!report_.duplicate_of.empty()) return report_;
    add_to_state();
    return report_;
  }

 private:
  const GridShape& shape() const { return grid_.info.shape; }
  void say(double share) const {
    if (options_.progress) options_.progress(share);
  }

  void describe() {
    GridInfo& g = grid_.info;
    const Quantiser& q = ingest_->quantiser();
    g.name = options_.name, g.frame = source_.frame(), g.shape = ingest_->shape(),
    g.accuracy = source_.accuracy();
    g.quantum = source_.scale() * q.quantum, g.base = source_.offset(), g.code_origin = q.origin;
    g.quantisation = q.error * std::abs(source_.scale());
    const Extent place = g.bounds();
    if (!std::isfinite(place.xmax - place.xmin) || !std::isfinite(place.ymax - place.ymin))
      throw Error(source_.path(), "its geotransform puts it beyond all numbers",
                  "georeference the file again");
    const double a = source_.scale() * ingest_->lowest() + source_.offset(),
                 b = source_.scale() * ingest_->highest() + source_.offset();
    g.lowest = std::min(a, b), g.highest = std::max(a, b);
    g.holes = !ingest_->masks().empty(), g.sample_bytes = source_.sample_bytes();
    g.sample_type = source_.sample_type(), g.raw_scale = source_.scale(), g.nodata = source_.nodata();
    const double numbers[] = {g.accuracy,
                              g.quantum,
                              g.base,
                              double(g.code_origin),
                              g.shape.pad(),
                              double(g.shape.width()),
                              double(g.shape.height())};
    digest_.add(numbers, std::size(numbers));
    digest_.add(g.frame.numbers().data(), g.frame.numbers().size());
    // The row is needed first: payloads name the grid's id. Name and digest are set right at the end; until
    // then a grid that is to be replaced may have the name.
    g.digest = provisional_digest(), g.name = "(import) " + options_.name;
    g.id = db_.store->add_grid(g);
    g.name = options_.name;
  }
  Digest provisional_digest() const {
    DigestBuilder d;
    d.add(options_.name.data(), options_.name.size());
    return d.get();
  }

  void digest(const Ingest::Band& band) {
    const Lattice& l = band.levels[0];
    for (int y = band.y0; y < band.y1; ++y) {
      digest_.add(l.row(y), size_t(shape().width()));
      if (!band.valid.empty())
        digest_.add(band.valid.data() + size_t(y - l.first()) * size_t(shape().width()),
                    size_t(shape().width()));
      note_rim(band, y);
    }
  }

  // Differences across the border of a pixel-is-area grid: how far the half cell beyond it leaves the outer
  // samples (first ones), and what it may hide (second ones).
  void note_rim(const Ingest::Band& band, int y) {
    const int w = shape().width(), h = shape().height();
    if (!shape().pixel_is_area()) return;
    const Lattice& l = band.levels[0];
    const auto note = [&](int i, int j, int di, int dj, Rim& rim) {
      const auto at = [&](int n) { return double(l.row(j + n * dj)[i + n * di]); };
      const auto valid = [&](int n) {
        return band.valid.empty() ||
               band.valid[size_t(j + n * dj - l.first()) * size_t(w) + size_t(i + n * di)];
      };
      if (!valid(0) || !valid(1)) return;
      rim.step = std::max(rim.step, std::abs(at(0) - at(1)));
      if ((di ? w : h) > 2 && valid(2)) rim.bend = std::max(rim.bend, std::abs(at(0) - 2 * at(1) + at(2)));
    };
    note(0, y, 1, 0, rim_i_), note(w - 1, y, -1, 0, rim_i_);
    if (y == 0 || y == h - 1)
      for (int i = 0; i < w; ++i) note(i, y, 0, y == 0 ? 1 : -1, rim_j_);
  }

  const Lattice& lattice(const Ingest::Band& band, int level) const {
    return level < Ingest::kStreamedLevels ? band.levels[size_t(level)] : ingest_->coarse(level);
  }

  void measure(const Ingest::Band& band) {
    const int tasks = (band.y1 - band.y0 + kTaskRows - 1) / kTaskRows;
    tbb::parallel_for(0, tasks * shape().levels(), [&](int task) {
      const int level = task / tasks, y0 = band.y0 + task % tasks * kTaskRows;
      const int y1 = std::min(band.y1, y0 + kTaskRows);
      errors_->measure(lattice(band, level), band.levels[0], band.valid, y0, y1);
    });
  }

  // The margin behind a band may reach the last row; its chunks belong to the band that ends there.
  int chunk_end(const Lattice& l, int y1) const {
    return y1 == shape().height() ? l.rows() : y1 >> l.level();
  }

  // The lattice that a level's chunks are predicted from; null for the coarsest.
  const Lattice* parent_of(const Lattice& l, const Ingest::Band* band) const {
    const int up = l.level() + 1;
    if (up == shape().levels()) return nullptr;
    return band && up < Ingest::kStreamedLevels ? &band->levels[size_t(up)] : &ingest_->coarse(up);
  }

  // Chunks of level rows [r0, r1), four at a time: those that share a parent. `band` holds the rows of level
  // 0 that the lattice was made of.
  void encode(const Lattice& l, int r0, int r1, const Ingest::Band* band) {
    const int first = r0 / kChunkVertices, end = (r1 + kChunkVertices - 1) / kChunkVertices;
    const int across = shape().chunks_i(l.level()), parents = (across + 1) / 2;
    const Lattice* const up = parent_of(l, band);
    std::vector<Bytes> blobs(size_t(std::max(0, end - first)) * size_t(across));
    tbb::parallel_for(0, blobs.empty() ? 0 : parents * ((end + 1) / 2 - first / 2), [&](int task) {
      const int px = task % parents, py = first / 2 + task / parents;
      const Chunk parent = up ? cut_codes(*up, px, py) : Chunk();
      for (int cy = std::max(first, 2 * py); cy < std::min(end, 2 * py + 2); ++cy)
        for (int cx = 2 * px; cx < std::min(across, 2 * px + 2); ++cx)
          blobs[size_t(cy - first) * size_t(across) + size_t(cx)] =
              encode_chunk(cut_chunk(l, cx, cy, band), up ? &parent : nullptr, cx, cy);
    });
    report_.seconds.encode += watch_.lap();
    for (std::size_t k = 0; k < blobs.size(); ++k) {
      const PatchId id = PatchId::make(grid_.info.id, l.level(), int(k) % across, first + int(k) / across);
      db_.store->put_blob(Store::Kind::payload, id.value, blobs[k]);
    }
    report_.seconds.store += watch_.lap();
  }

  Chunk cut_codes(const Lattice& l, int cx, int cy) const {
    Chunk c = make_chunk(shape(), l.level(), cx, cy);
    c.codes.resize(size_t(c.cols) * size_t(c.rows));
    for (int j = 0; j < c.rows; ++j) {
      const float* from = l.row(cy * kChunkVertices + j) + cx * kChunkVertices;
      std::int32_t* to = c.codes.data() + size_t(j) * size_t(c.cols);
      for (int i = 0; i < c.cols; ++i) {
        // Where a cell of a coarse level is far longer than the grid is wide, what continues it may grow so.
        if (!(std::abs(from[i]) < 0x1p31f))
          throw Error(source_.path(), "it is too narrow for its length", "cut it into shorter pieces");
        to[i] = std::int32_t(from[i]);
      }
    }
    return c;
  }

  Chunk cut_chunk(const Lattice& l, int cx, int cy, const Ingest::Band* band) const {
    Chunk c = cut_codes(l, cx, cy);
    if (ingest_->masks().empty()) return c;
    const MaskCells cells(ingest_->masks(), l.level());
    bool real = true;
    for (int j = 0; j < c.rows; ++j)
      for (int i = 0; i < c.cols; ++i) {
        const int x = cx * kChunkVertices + i, y = cy * kChunkVertices + j;
        c.cells.push_back(cells.cell(x, y));
        if (l.level() == 0 && holds_data(*band, x, y)) c.cells.back() |= CellMasks::kVertex;
        real &= (c.cells.back() & CellMasks::kReal) != 0;
      }
    if (real) c.cells.clear();
    return c;
  }

  bool holds_data(const Ingest::Band& band, int x, int y) const {
    if (x >= shape().width() || y >= shape().height()) return false;
    const int first = band.levels[0].first();
    return band.valid.empty() || band.valid[size_t(y - first) * size_t(shape().width()) + size_t(x)];
  }

  void finish_grid() {
    GridInfo& g = grid_.info;
    g.digest = digest_.get();
    g.rim_error = kRimFactor * (rim_i_.bend + rim_j_.bend) * std::abs(g.quantum);
    // Half a step along each axis; and at a corner the one's step may be twice as large, extrapolated itself.
    const double rim = 0.5 * (rim_i_.step + rim_j_.step + std::min(rim_i_.step, rim_j_.step));
    g.overshoot = g.quantisation + (rim + errors_->largest_departure()) * std::abs(g.quantum);
    for (const Grid& other : db_.grids)
      if (other.info.digest == g.digest) report_.duplicate_of = other.info.name;
    report_.name = g.name, report_.accuracy = g.accuracy, report_.quantisation = g.quantisation;
    report_.extent = g.bounds();
    if (!report_.duplicate_of.empty()) return;
    make_records();
    bool exists = false;
    grid_.patches.each([&](std::size_t, const PatchRecord& p) { exists |= p.exists(); });
    if (!exists) throw Error(source_.path(), "it holds no cell with data at all four corners");
  }

  void make_records() {
    ingest_->drop_coarse();
    grid_.patches = PatchRecords(shape().blocks());
    LazyTable<RecordRun>& runs = grid_.patches.runs();
    tbb::parallel_for(size_t(0), runs.size(), [&](std::size_t n) {
      RecordRun& run = runs.change(n);
      for (std::size_t i = 0; i < run.records.size(); ++i)
        make_record(n * RecordRun::kRecords + i, run.records[i], run.offers);
    });
    errors_.reset(), ingest_.reset();
  }

  void make_record(std::size_t k, PatchRecord& p, std::vector<Offer>& offers) const {
    const GridShape::Block b = shape().block(k);
    p.flags = PatchRecord::kExists;
    double outline = 0;
    if (!ingest_->masks().empty()) {
      Offer offer;
      outline = look_at_holes(b, p, offer);
      offer.index = std::uint32_t(k);
      if (p.exists() && p.ragged()) offers.push_back(offer);
    }
    const std::array<double, 3> delta = errors_->of(b.level, b.bx, b.by);
    const double floor = source_.accuracy_in(shape().domain(b.level, b.bx, b.by)) + grid_.info.quantisation;
    for (std::size_t i = 0; i < 3; ++i)
      p.error[i] = std::max(floor + delta[i] * std::abs(grid_.info.quantum), outline);
    if (!std::all_of(p.error.begin(), p.error.end(), [](double e) { return std::isfinite(e); }))
      throw Error(source_.path(), "its heights reach too far to be stored",
                  "is there a value that means no data? give it with --nodata");
    p.bottom = b.level == 0 ? p.error[0] : *std::max_element(p.error.begin(), p.error.end());
  }

  // Sets the record's flags; returns the error that the outline of holes alone gives it, metres.
  double look_at_holes(const GridShape::Block& b, PatchRecord& p, Offer& offer) const {
    const MaskCells cells(ingest_->masks(), b.level);
    bool answers = false, differ = false;
    const LatticeRect d = shape().domain(b.level, b.bx, b.by);
    const int step = 1 << b.level, i0 = b.bx * kKernelCells, j0 = b.by * kKernelCells;
    // The domain's cells; behind a last block they have no other patch to answer for them.
    const int end_i = int(std::ceil(d.i1 / step)), end_j = int(std::ceil(d.j1 / step));
    const int own_i = b.bx + 1 == shape().blocks_i(b.level) ? end_i : i0 + kKernelCells;
    const int own_j = b.by + 1 == shape().blocks_j(b.level) ? end_j : j0 + kKernelCells;
    for (int y = int(std::floor(d.j0 / step)); y < end_j; ++y)
      for (int x = int(std::floor(d.i0 / step)); x < end_i; ++x) {
        const std::uint8_t c = cells.cell(x, y);
        differ |= (c & CellMasks::kAnswering) && !(c & CellMasks::kReal);
        const bool inside = x >= i0 && y >= j0 && x < own_i && y < own_j;
        answers |= inside && (c & CellMasks::kAnswering);
      }
    if (!answers) p.flags = 0;
    if (!answers || !make_holes(cells, b.level, b.bx, b.by)) return 0;
    p.flags |= PatchRecord::kRagged;
    offer = make_offer(cells, b.level, b.bx, b.by);
    return differ ? std::hypot(grid_.info.frame.step_i(), grid_.info.frame.step_j()) * std::ldexp(1, b.level)
                  : 0;
  }

  // The grid joins the others; the report says what that does.
  void add_to_state() {
    Restate restate(db_);
    if (!options_.replace.empty()) restate.remove(db_.place(options_.replace));
    db_.store->update_grid(grid_.info);
    restate.add(std::move(grid_));
    report_.seconds.invariant += watch_.lap();
    restate.store((options_.replace.empty() ? "import " : "replace ") + report_.name);
    report_.seconds.store += watch_.lap();
    const Restate::Effect& e = restate.effect();
    report_.patches = e.added, report_.dormant = e.dormant, report_.hidden = e.hidden,
    report_.lowered = e.lowered, report_.woken = e.woken, report_.removed = e.removed;
  }

  Database::Impl& db_;
  const ImportOptions& options_;
  const RasterSource& source_;
  ImportReport report_;
  Stopwatch watch_;
  std::optional<Ingest> ingest_;  // both until the records are made
  std::optional<PatchErrors> errors_;
  Grid grid_;
  DigestBuilder digest_;
  struct Rim {
    double step = 0, bend = 0;  // the largest first and second difference across it, codes
  };
  Rim rim_i_, rim_j_;
};

// The first grid brings the CRS.
void settle_crs(Database::Impl& db, const RasterSource& source) {
  if (source.crs().empty() || source.crs() == db.crs) return;
  if (db.crs.empty() && db.grids.empty()) {
    db.store->set_fact("crs", source.crs());
    db.crs = source.crs();
  } else if (!same_crs(db.crs, source.crs())) {
    throw Error(source.path(), "it was placed in another CRS than the database's", "import it again");
  }
}

}  // namespace

ImportReport Database::import(const RasterSource& source, const ImportOptions& options) {
  const Stopwatch watch;
  ImportReport report;
  double committing = 0;
  impl_->change([&] {
    if (options.progress) options.progress(0);
    settle_crs(*impl_, source);
    if (!options.replace.empty()) impl_->place(options.replace);
    for (const Grid& g : impl_->grids)
      if (g.info.name == options.name && options.name != options.replace)
        throw Error(source.path(), "the database has a grid named " + options.name + " already",
                    "give another with --name, or take its place with --replace " + options.name);
    report = Importer(*impl_, source, options).run();
    if (!options.replace.empty() && !report.duplicate_of.empty() && report.duplicate_of != options.replace)
      throw Error(source.path(), "the same grid is there as " + report.duplicate_of + " already",
                  "take " + options.replace + " out instead: patchwork remove DB " + options.replace);
    committing = watch.seconds();
    if (options.progress) options.progress(1);
    return !options.dry_run && report.duplicate_of.empty();
  });
  report.seconds.store += watch.seconds() - committing;
  report.seconds.total = watch.seconds();
  return report;
}

}  // namespace patchwork
