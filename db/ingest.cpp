#include "db/ingest.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>
#include <set>

#include "db/error.h"
#include "db/vectorized.h"

namespace patchwork {

namespace {

constexpr int kStripRows = 64;  // raw samples that are held at a time, where all do not fit
constexpr int kMargin = 24;     // rows around a band: stencils of the streamed levels, and filled holes
constexpr double kCodeRange = 1 << 23;  // codes stay exact in float32, their differences too
constexpr int kFillRings = 4;
constexpr std::size_t kBandSamples = std::size_t{4} << 20;  // of a band: more gain nothing

// The exponent of the lowest bit set in a finite number.
int lowest_bit(double v) {
  if (v == 0) return 1 << 20;
  const auto bits = std::bit_cast<std::uint64_t>(v);
  const int exponent = int(bits >> 52 & 0x7ff);
  const std::uint64_t mantissa = bits & 0xfffffffffffff;
  const std::uint64_t full = exponent ? mantissa | 1ull << 52 : mantissa;
  return std::max(exponent, 1) - 1075 + std::countr_zero(full);
}

// The rows or columns along an axis of n samples that levels >= kStreamedLevels read.
std::vector<int> knots_along(int n, int levels) {
  std::set<int> knots;
  for (int i = 0; i < n; i += 1 << Ingest::kStreamedLevels) knots.insert(i);
  for (int l = Ingest::kStreamedLevels; l < levels; ++l) {
    const LatticeAxis axis(n, l);
    knots.insert({axis.last, axis.before});
  }
  return {knots.begin(), knots.end()};
}

// code_of() of n samples.
template <class Raw>
[[gnu::always_inline]] inline void to_codes(const Raw* raw, std::size_t n, double quantum, double origin,
                                            float* __restrict codes) {
  for (std::size_t k = 0; k < n; ++k) codes[k] = float(std::nearbyint(double(raw[k]) / quantum) - origin);
}
PATCHWORK_VECTORIZED void codes_of(const float* raw, std::size_t n, double quantum, double origin,
                                   float* codes) {
  to_codes(raw, n, quantum, origin, codes);
}
PATCHWORK_VECTORIZED void codes_of(const double* raw, std::size_t n, double quantum, double origin,
                                   float* codes) {
  to_codes(raw, n, quantum, origin, codes);
}

}  // namespace

Ingest::Ingest(const RasterSource& source, std::size_t memory, double tolerance, const Progress& progress)
    : source_(source), shape_(source.width(), source.height(), source.pixel_is_area()) {
  const std::size_t samples = size_t(shape_.width()) * size_t(shape_.height());
  if (source.float_is_exact() && samples * sizeof(float) <= memory / 4) kept_ = Buffer<float>(samples);
  // A sample of a band costs its code, its mask, and its code and a third again in the levels made of it.
  const std::size_t chunk_rows = std::size_t{kChunkVertices} << (kStreamedLevels - 1);
  const std::size_t band = std::min(kBandSamples, memory / 4 / 12) / (size_t(shape_.width()) * chunk_rows);
  band_rows_ = int(std::max<std::size_t>(1, band) * chunk_rows);
  knot_cols_ = knots_along(shape_.width(), shape_.levels());
  knot_rows_ = knots_along(shape_.height(), shape_.levels());
  knots_.resize(knot_cols_.size() * knot_rows_.size());
  means_cols_ = (shape_.width() + 7) / 8, means_rows_ = (shape_.height() + 7) / 8;
  means_.resize(size_t(means_cols_) * size_t(means_rows_));
  scan(progress);
  if (!(low_ <= high_)) throw Error(source.path(), "it holds no data: every sample is nodata");
  choose_quantiser(tolerance);
  if (!cells_.empty()) {
    fill_means();
    masks_ = CellMasks::from_cells(std::move(cells_), shape_);
  } else {
    std::vector<double>().swap(means_);  // `means_ = {}` would keep the memory, as would clear()
  }
  make_coarse();
}

// Calls visit(row, rows, samples) for strips of raw samples of rows [first, end).
template <class Raw, class Visit>
void Ingest::read_strips(int first, int end, Visit visit) const {
  Buffer<Raw> strip(size_t(std::min(kStripRows, end - first)) * size_t(shape_.width()));
  for (int y = first; y < end; y += kStripRows) {
    const int rows = std::min(kStripRows, end - y);
    source_.read_rows(y, rows, std::span<Raw>(strip.data(), size_t(rows) * size_t(shape_.width())));
    visit(y, rows, strip.data());
  }
}

void Ingest::scan(const Progress& progress) {
  low_ = INFINITY, high_ = -INFINITY;
  const auto note = [&](int y, int rows, const auto* raw) {
    scan_rows(y, rows, raw);
    if (progress) progress(double(y + rows) / shape_.height());
  };
  if (kept_.empty()) {
    if (source_.float_is_exact()) return read_strips<float>(0, shape_.height(), note);
    return read_strips<double>(0, shape_.height(), note);
  }
  for (int y = 0; y < shape_.height(); y += 4 * kStripRows) {
    const int rows = std::min(4 * kStripRows, shape_.height() - y);
    const std::size_t n = size_t(rows) * size_t(shape_.width());
    float* raw = kept_.data() + size_t(y) * size_t(shape_.width());
    source_.read_rows(y, rows, std::span<float>(raw, n));
    note(y, rows, raw);
  }
}

template <class Raw>
void Ingest::scan_rows(int y, int rows, const Raw* raw) {
  const int w = shape_.width();
  const bool integers = source_.integer_samples();
  std::mutex mutex;
  bool holes = false;
  tbb::parallel_for(0, (rows + 7) / 8, [&](int octet) {
    double low = INFINITY, high = -INFINITY;
    int bit = 1 << 20;
    bool nan = false;
    double* means = means_.data() + (size_t(y) / 8 + size_t(octet)) * size_t(means_cols_);
    std::vector<int> counts(static_cast<size_t>(means_cols_));
    for (int r = octet * 8; r < std::min(rows, octet * 8 + 8); ++r) {
      const Raw* row = raw + size_t(r) * size_t(w);
      for (int i = 0; i < w; ++i) {
        const double v = row[i];
        if (v != v) {
          nan = true;
          continue;
        }
        low = v < low ? v : low, high = v > high ? v : high;
        means[i >> 3] += v, ++counts[size_t(i) >> 3];
        if (!integers) bit = std::min(bit, lowest_bit(v));
      }
      const auto knot = std::lower_bound(knot_rows_.begin(), knot_rows_.end(), y + r);
      if (knot != knot_rows_.end() && *knot == y + r) {
        double* out = knots_.data() + size_t(knot - knot_rows_.begin()) * knot_cols_.size();
        for (const int c : knot_cols_) *out++ = row[c];
      }
    }
    for (int i = 0; i < means_cols_; ++i) means[i] /= counts[size_t(i)];  // NaN where none is valid
    const std::lock_guard lock(mutex);
    low_ = std::min(low_, low), high_ = std::max(high_, high), finest_bit_ = std::min(finest_bit_, bit);
    holes |= nan;
  });
  if (cells_.empty() && !holes) return;
  std::vector<std::uint8_t> valid(size_t(rows) * size_t(w));
  for (std::size_t k = 0; k < valid.size(); ++k) valid[k] = raw[k] == raw[k];
  note_cells(y, rows, valid);
}

void Ingest::note_cells(int y, int rows, const std::vector<std::uint8_t>& valid) {
  const std::size_t w = size_t(shape_.width());
  if (cells_.empty()) {
    cells_.assign((w - 1) * size_t(shape_.height() - 1), 1);
    last_row_valid_.assign(w, 1);
  }
  for (int r = 0; r < rows; ++r) {
    const std::uint8_t* v = valid.data() + size_t(r) * w;
    if (y + r > 0) {
      std::uint8_t* cells = cells_.data() + size_t(y + r - 1) * (w - 1);
      for (std::size_t i = 0; i + 1 < w; ++i)
        cells[i] = last_row_valid_[i] & last_row_valid_[i + 1] & v[i] & v[i + 1];
    }
    last_row_valid_.assign(v, v + w);
  }
}

void Ingest::choose_quantiser(double tolerance) {
  const double range = high_ - low_;
  const double fits = std::exp2(std::ceil(std::log2(std::max(range, 1e-300) / kCodeRange)));
  if (source_.integer_samples()) {
    quantiser_.quantum = std::max(1.0, fits);
  } else {
    // Exact if that costs at most 64 codes for each accuracy; else 16 codes for each, which adds 1/32 of it.
    const double accuracy = source_.accuracy() / std::abs(source_.scale());
    const double exact = std::ldexp(1, std::clamp(finest_bit_, -60, 60));
    const double coarse = accuracy > 0 ? std::exp2(std::floor(std::log2(accuracy / 16))) : fits;
    quantiser_.quantum = exact >= fits && exact * 4 >= coarse ? exact : std::max(coarse, fits);
  }
  // A hair below twice the tolerance, so that rounding the quotient cannot pass it.
  const double wide = 2 * tolerance / std::abs(source_.scale()) * (1 - 0x1p-20);
  const bool loose = wide > quantiser_.quantum;
  if (loose) quantiser_.quantum = wide;
  const bool exact = quantiser_.quantum <= (source_.integer_samples() ? 1.0 : std::ldexp(1, finest_bit_));
  quantiser_.error = exact ? 0 : quantiser_.quantum / 2;
  if (loose) quantiser_.error = tolerance / std::abs(source_.scale());
  const double largest = std::max(std::abs(low_), std::abs(high_)) / quantiser_.quantum;
  if (largest >= kCodeRange)
    quantiser_.origin = std::int64_t(std::floor((low_ + range / 2) / quantiser_.quantum));
}

double Ingest::code_of(double raw) const {
  return std::nearbyint(raw / quantiser_.quantum) - double(quantiser_.origin);
}

// Means of 8 x 8 samples; where there are none, those of the smallest square of 16, 32, ... that has any.
void Ingest::fill_means() {
  struct Plane {
    int cols, rows;
    std::vector<double> v;
  };
  std::vector<Plane> up{{means_cols_, means_rows_, means_}};
  while (up.back().cols > 1 || up.back().rows > 1) {
    const Plane& fine = up.back();
    Plane coarse{(fine.cols + 1) / 2, (fine.rows + 1) / 2, {}};
    for (int j = 0; j < coarse.rows; ++j)
      for (int i = 0; i < coarse.cols; ++i) {
        double sum = 0, count = 0;
        for (int y = 2 * j; y < std::min(2 * j + 2, fine.rows); ++y)
          for (int x = 2 * i; x < std::min(2 * i + 2, fine.cols); ++x)
            if (const double v = fine.v[size_t(y) * size_t(fine.cols) + size_t(x)]; v == v) sum += v, ++count;
        coarse.v.push_back(sum / count);
      }
    up.push_back(std::move(coarse));
  }
  for (std::size_t p = up.size() - 1; p-- > 0;)
    for (int j = 0; j < up[p].rows; ++j)
      for (int i = 0; i < up[p].cols; ++i)
        if (double& v = up[p].v[size_t(j) * size_t(up[p].cols) + size_t(i)]; v != v)
          v = up[p + 1].v[size_t(j / 2) * size_t(up[p + 1].cols) + size_t(i / 2)];
  means_ = std::move(up[0].v);
}

double Ingest::knot(int i, int j) const {
  const auto place = [](const std::vector<int>& knots, int at) {
    const std::size_t guess = size_t(at) / 8;
    if (guess < knots.size() && knots[guess] == at) return guess;
    return size_t(std::lower_bound(knots.begin(), knots.end(), at) - knots.begin());
  };
  const double raw = knots_[place(knot_rows_, j) * knot_cols_.size() + place(knot_cols_, i)];
  return code_of(raw == raw ? raw : means_[size_t(j / 8) * size_t(means_cols_) + size_t(i / 8)]);
}

void Ingest::make_coarse() {
  for (int l = kStreamedLevels; l < shape_.levels(); ++l)
    coarse_.push_back(
        make_lattice(shape_, l, 0, shape_.lattice_rows(l), [&](int i, int j) { return knot(i, j); }));
  std::vector<double>().swap(knots_);
}

// The vertices next to data continue them linearly, so that an interpolant's slope there is that of the data;
// what lies deeper is the mean of its neighbours, ring by ring, then the mean of a neighbourhood.
void Ingest::fill_holes(Lattice& codes, std::span<const std::uint8_t> valid) const {
  const int w = shape_.width(), first = codes.first(), rows = codes.count();
  std::vector<std::uint8_t> ring(valid.begin(), valid.end());  // 1: has a value
  const auto has = [&](int i, int j) {
    return i >= 0 && i < w && j >= 0 && j < rows && ring[size_t(j) * size_t(w) + size_t(i)];
  };
  const auto at = [&](int i, int j) -> double { return codes.row(first + j)[i]; };
  std::vector<std::pair<std::size_t, float>> found;
  for (int sweep = 0; sweep < kFillRings; ++sweep) {
    found.clear();
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < w; ++i) {
        if (has(i, j)) continue;
        double sum = 0;
        int count = 0;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) {
            if (!has(i + di, j + dj)) continue;
            const bool slope = sweep == 0 && has(i + 2 * di, j + 2 * dj);
            sum += slope ? 2 * at(i + di, j + dj) - at(i + 2 * di, j + 2 * dj) : at(i + di, j + dj), ++count;
          }
        if (count) found.emplace_back(size_t(j) * size_t(w) + size_t(i), float(std::nearbyint(sum / count)));
      }
    for (const auto& [k, v] : found) codes.row(first + int(k / size_t(w)))[k % size_t(w)] = v, ring[k] = 1;
  }
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < w; ++i)
      if (!has(i, j))
        codes.row(first + j)[i] =
            float(code_of(means_[size_t((first + j) / 8) * size_t(means_cols_) + size_t(i / 8)]));
}

Ingest::Band Ingest::read_band(int y0, int y1) const {
  const int w = shape_.width(), first = std::max(0, y0 - kMargin),
            end = std::min(shape_.height(), y1 + kMargin);
  const std::size_t n = size_t(end - first) * size_t(w);
  Lattice codes(shape_, 0, first, end - first);  // level 0 is the samples themselves
  Band band{y0, y1, {}, {}};
  if (!masks_.empty()) band.valid.resize(n);
  const auto take = [&](int y, int rows, const auto* raw) {
    tbb::parallel_for(size_t(0), size_t(rows), [&](std::size_t r) {
      const std::size_t from = r * size_t(w), to = (size_t(y - first) + r) * size_t(w);
      codes_of(raw + from, size_t(w), quantiser_.quantum, double(quantiser_.origin), codes.row(y + int(r)));
      if (band.valid.empty()) return;
      for (std::size_t k = 0; k < size_t(w); ++k) band.valid[to + k] = raw[from + k] == raw[from + k];
    });
  };
  if (!kept_.empty())
    take(first, end - first, kept_.data() + size_t(first) * size_t(w));
  else if (source_.float_is_exact())
    read_strips<float>(first, end, take);
  else
    read_strips<double>(first, end, take);
  if (!band.valid.empty()) fill_holes(codes, band.valid);
  codes.extrapolate_ring();
  band.levels.push_back(std::move(codes));
  for (int l = 1; l < std::min(kStreamedLevels, shape_.levels()); ++l) {
    // Every level row whose samples are at hand; the one beyond the last sample needs the last and one
    // before.
    const int from = (first + (1 << l) - 1) >> l;
    const int to = end == shape_.height() ? shape_.lattice_rows(l) : ((end - 1) >> l) + 1;
    const Lattice& samples = band.levels.front();
    Lattice made = make_lattice(shape_, l, from, to - from, [&](int i, int j) { return samples.row(j)[i]; });
    band.levels.push_back(std::move(made));
  }
  return band;
}

}  // namespace patchwork
