#include "db/patch_errors.h"

#include <algorithm>
#include <cmath>

#include "db/basis.h"
#include "db/float_rounding.h"
#include "db/vectorized.h"

namespace patchwork {

namespace {

constexpr int kStrip = 2048;  // columns worked on at once: their rows stay in the second-level cache

// Segments cut an axis at the block borders and two level cells on either side of them, so that the domain of
// a block is five whole segments: the last of its neighbour, its own three, the first of its other neighbour.
int segment_start(int segment, int level) {
  static constexpr int offset[3] = {0, kExtensionCells, kKernelCells - kExtensionCells};
  return (segment / 3 * kKernelCells + offset[segment % 3]) << level;
}
int segments(double last, int level) {
  int n = int(last / std::ldexp(kKernelCells, level)) * 3;
  while (segment_start(n, level) <= last) ++n;
  return n;
}

// The blocks whose domain a segment lies in: two where it is a rim; the last one has all that is left.
struct BlockSpan {
  BlockSpan(int segment, int blocks)
      : first(std::clamp((segment - 1) / 3, 0, blocks - 1)), last(std::min((segment + 1) / 3, blocks - 1)) {}
  int first, last;
};

// On these levels errors are measured at every half cell too: there the interpolants bend most between two
// samples.
int per_cell(int level) { return level == 1 || level == 2 ? 2 : 1; }

}  // namespace

// Where along an axis errors are measured: the samples, perhaps the middles between, the ends of the outer
// half cells.
struct PatchErrors::Positions {
  Positions(int count, double pad, int level)
      : per(per_cell(level)),
        n((count - 1) * per + 1 + (pad > 0 ? 2 : 0)),
        first(pad > 0 ? 1 : 0),
        samples(count) {}
  double at(int p) const { return p < first ? -0.5 : std::min(double(p - first) / per, samples - 0.5); }
  int place(int sample) const { return first + sample * per; }
  int per, n, first, samples;
};

namespace {

using Positions = PatchErrors::Positions;

struct Phase {  // of every position of a strip on one level's lattice
  std::vector<int> cell;
  std::vector<double> t;
  std::vector<CellWeights> cubic, quintic;
};

Phase make_phase(const Positions& positions, int p0, int p1, int level) {
  const auto n = size_t(p1 - p0);
  Phase phase{std::vector<int>(n), std::vector<double>(n), std::vector<CellWeights>(n),
              std::vector<CellWeights>(n)};
  const double cells = std::ldexp(1, -level);
  for (size_t k = 0; k < n; ++k) {
    const double u = positions.at(p0 + int(k)) * cells, cell = std::floor(u);
    phase.cell[k] = int(cell), phase.t[k] = u - cell;
    phase.cubic[k] = cell_weights<1>(u - cell), phase.quintic[k] = cell_weights<2>(u - cell);
  }
  return phase;
}

// What one lattice row gives at every position of a strip, and what the row of cells below it hides between
// positions.
struct RowUp {
  int row = -9;
  std::vector<double> linear, cubic, quintic, hidden;
};

[[gnu::always_inline]] inline double weigh(CellWeights w, double a, double b, double c, double d) {
  return b + (w.before * (a - b) + w.far * (c - b) + w.beyond * (d - b));
}

// One lattice row taken to every position of the strip by the three interpolants.
PATCHWORK_VECTORIZED void upsample(const float* v, int n, const int* cell, const double* t,
                                   const CellWeights* w1, const CellWeights* w2, double* __restrict linear,
                                   double* __restrict cubic, double* __restrict quintic) {
  for (int p = 0; p < n; ++p) {
    const int c = cell[p];
    const double a = v[c - 1], b = v[c], d = v[c + 1], e = v[c + 2];
    linear[p] = b + t[p] * (d - b);
    cubic[p] = weigh(w1[p], a, b, d, e), quintic[p] = weigh(w2[p], a, b, d, e);
  }
}

// Largest distances so far, position by position. NaN in z (no data) never wins a comparison.
PATCHWORK_VECTORIZED void accumulate(const double* z, const RowUp& r0, const RowUp& r1, const RowUp& r2,
                                     const RowUp& r3, const double* hidden, double t, int n,
                                     double* __restrict linear, double* __restrict smooth) {
  const double *a1 = r0.cubic.data(), *b1 = r1.cubic.data(), *c1 = r2.cubic.data(), *d1 = r3.cubic.data();
  const double *a2 = r0.quintic.data(), *b2 = r1.quintic.data(), *c2 = r2.quintic.data(),
               *d2 = r3.quintic.data();
  const double *b0 = r1.linear.data(), *c0 = r2.linear.data();
  const CellWeights w1 = cell_weights<1>(t), w2 = cell_weights<2>(t);
  for (int p = 0; p < n; ++p) {
    const double e = std::abs(b0[p] + t * (c0[p] - b0[p]) - z[p]);
    const double f = std::abs(weigh(w1, a1[p], b1[p], c1[p], d1[p]) - z[p]);
    const double g = std::abs(weigh(w2, a2[p], b2[p], c2[p], d2[p]) - z[p]);
    const double s = (f > g ? f : g) + hidden[p];
    linear[p] = e > linear[p] ? e : linear[p];
    smooth[p] = s > smooth[p] ? s : smooth[p];
  }
}

// How far a smooth interpolant may depart, between measured positions, from what is measured there: by level
// (see the header), from second differences along each axis at the cell's corners (inner) and one vertex
// further out (outer).
struct HiddenBound {
  explicit HiddenBound(int l) : level(l), apart(std::ldexp(1, l) * per_cell(l)) {}
  double of(double i_inner, double i_outer, double j_inner, double j_outer) const {
    const double i = kInnerWeights * i_inner + kOuterWeights * i_outer;
    const double j = kInnerWeights * j_inner + kOuterWeights * j_outer;
    if (level == 0) return kDepartureFromLinear * std::min(i + j_inner, i_inner + j);
    return kSecondDerivative * (i + j) / (8 * apart * apart);
  }
  int level;
  double apart;  // measured positions in a level cell
};

// Second differences around a row of cells: along i in the rows at the cells and outside them, along j at the
// cells.
struct Bends {
  std::vector<double> i_inner, i_outer, j;
};

PATCHWORK_VECTORIZED void bends(const float* a, const float* b, const float* c, const float* d, int n,
                                double* __restrict i_inner, double* __restrict i_outer,
                                double* __restrict j) {
  const auto along = [](const float* v, int i) {
    return std::abs(double(v[i - 1]) - 2 * double(v[i]) + double(v[i + 1]));
  };
  for (int i = 0; i < n; ++i) {
    const double outer0 = along(a, i), inner0 = along(b, i), inner1 = along(c, i), outer1 = along(d, i);
    i_inner[i] = inner0 > inner1 ? inner0 : inner1, i_outer[i] = outer0 > outer1 ? outer0 : outer1;
    const double here = std::abs(double(a[i]) - 2 * double(b[i]) + double(c[i]));
    const double next = std::abs(double(b[i]) - 2 * double(c[i]) + double(d[i]));
    j[i] = here > next ? here : next;
  }
}

// Bounds for the cells [c0, c1) between lattice rows r and r + 1: their interpolants read rows r - 1 .. r
// + 2.
void hidden_in_cells(const Lattice& lattice, int r, int c0, int c1, Bends& bend, std::vector<double>& out) {
  // What lies beyond the ring has no second difference: the ring continues linearly.
  const int from = std::max(c0 - 1, -1), to = std::min(c1 + 2, lattice.cols() + 1), n = to - from;
  for (auto* v : {&bend.i_inner, &bend.i_outer, &bend.j}) v->assign(size_t(c1 - c0 + 3), 0);
  const size_t skip = size_t(from - (c0 - 1));
  bends(lattice.row(r - 1) + from, lattice.row(r) + from, lattice.row(r + 1) + from,
        lattice.row(r + 2) + from, n, bend.i_inner.data() + skip, bend.i_outer.data() + skip,
        bend.j.data() + skip);
  const HiddenBound bound(lattice.level());
  out.resize(size_t(c1 - c0));
  for (size_t k = 0; k < out.size(); ++k)  // vertices of cell k: k + 1 and k + 2; k and k + 3 around it
    out[k] = bound.of(std::max(bend.i_inner[k + 1], bend.i_inner[k + 2]),
                      std::max(bend.i_outer[k + 1], bend.i_outer[k + 2]),
                      std::max(bend.j[k + 1], bend.j[k + 2]), std::max(bend.j[k], bend.j[k + 3]));
}

// The reference heights at the positions of a strip; half rows (outer half cells) are the mean of two rows.
class Reference {
 public:
  Reference(const Lattice& level0, std::span<const std::uint8_t> valid, const Positions& positions)
      : level0_(level0), valid_(valid), positions_(positions) {}

  void row(double y, int p0, int p1, double* out) const {
    const float *u = level0_.row(int(std::floor(y))), *v = level0_.row(int(std::ceil(y)));
    const int first = positions_.first, end = positions_.n - first;
    const auto between = [&](int p) {
      const int i = int(std::floor(positions_.at(p))), k = int(std::ceil(positions_.at(p)));
      return 0.25 * (double(u[i]) + u[k] + v[i] + v[k]);
    };
    const int a = std::max(p0, first), b = std::min(p1, end);
    if (positions_.per == 1)
      for (int p = a; p < b; ++p) out[p - p0] = 0.5 * (double(u[p - first]) + v[p - first]);
    else
      for (int p = a; p < b; ++p) {
        const int i = (p - first) >> 1, k = (p - first + 1) >> 1;
        out[p - p0] = 0.25 * (double(u[i]) + u[k] + v[i] + v[k]);
      }
    if (p0 < first) out[0] = between(0);
    if (p1 > end) out[p1 - 1 - p0] = between(p1 - 1);
    if (!valid_.empty()) hide(y, p0, p1, out);
  }

 private:
  // NaN wherever a sample that the height is made of holds no data.
  void hide(double y, int p0, int p1, double* out) const {
    const int cols = level0_.cols(), rows = level0_.rows();
    const auto mask = [&](double j) {
      return valid_.data() + size_t(std::clamp(int(j), 0, rows - 1) - level0_.first()) * size_t(cols);
    };
    const std::uint8_t *u = mask(std::floor(y)), *v = mask(std::ceil(y));
    const int half = positions_.per - 1;  // positions on either side of a sample's own that are made of it
    const int i0 = std::clamp((p0 - positions_.first) / positions_.per - 1, 0, cols - 1);
    const int end = std::clamp((p1 - positions_.first) / positions_.per + 2, 0, cols);
    for (int i = i0; i < end; ++i) {
      if (u[i] && v[i]) continue;
      const int a = i == 0 ? 0 : positions_.place(i) - half;
      const int b = i == cols - 1 ? positions_.n - 1 : positions_.place(i) + half;
      for (int p = std::max(a, p0); p <= std::min(b, p1 - 1); ++p) out[p - p0] = std::nan("");
    }
  }
  const Lattice& level0_;
  std::span<const std::uint8_t> valid_;
  const Positions& positions_;
};

}  // namespace

PatchErrors::PatchErrors(const GridShape& shape, const CellMasks& cells) : shape_(shape), cells_(cells) {
  const LatticeRect f = shape.footprint();
  for (int l = 0; l < shape.levels(); ++l) {
    const int ni = segments(f.i1, l), nj = segments(f.j1, l);
    levels_.push_back({ni, nj, std::vector<Largest>(size_t(shape.blocks_i(l)) * size_t(shape.blocks_j(l)))});
  }
}

// The strip of columns [p0, p1) of one level: rows of the lattice taken to its positions, the last four kept.
class PatchErrors::Strip {
 public:
  Strip(const Lattice& lattice, const CellMasks& masks, const Positions& positions, int p0, int p1)
      : lattice_(lattice),
        masks_(masks),
        n_(p1 - p0),
        phase_(make_phase(positions, p0, p1, lattice.level())) {}

  const RowUp& up(int r) {
    RowUp& u = ups_[(r + 4) & 3];
    if (u.row == r) return u;
    u.row = r;
    for (auto* v : {&u.linear, &u.cubic, &u.quintic}) v->resize(size_t(n_));
    u.hidden.clear();
    upsample(lattice_.row(r), n_, phase_.cell.data(), phase_.t.data(), phase_.cubic.data(),
             phase_.quintic.data(), u.linear.data(), u.cubic.data(), u.quintic.data());
    return u;
  }

  // Bounds at every position for the cells around it, those above too where the row of positions lies on a
  // lattice row.
  const double* hidden(int r, bool on_row) {
    if (hidden_row_ != r || hidden_on_row_ != on_row) {
      hidden_row_ = r, hidden_on_row_ = on_row;
      hidden_ = expanded(r);
      if (on_row) {
        const std::vector<double>& above = expanded(r - 1);
        for (std::size_t p = 0; p < hidden_.size(); ++p) hidden_[p] = std::max(hidden_[p], above[p]);
      }
    }
    return hidden_.data();
  }

 private:
  const std::vector<double>& expanded(int r) {
    auto& [row, at] = expanded_[r & 1];
    if (row == r) return at;
    row = r;
    const int c0 = phase_.cell.front() - (phase_.t.front() == 0), c1 = phase_.cell.back() + 1;
    hidden_in_cells(lattice_, r, c0, c1, bends_, cells_);
    if (!masks_.empty()) forget_unanswered(r, c0);
    at.resize(size_t(n_));
    for (std::size_t p = 0; p < at.size(); ++p) {
      const auto c = size_t(phase_.cell[p] - c0);
      at[p] = phase_.t[p] == 0 ? std::max(cells_[c], cells_[c - 1]) : cells_[c];
    }
    return at;
  }
  // A cell that does not answer is made of fill: what bends there is nobody's error.
  void forget_unanswered(int r, int c0) {
    const int level = lattice_.level(), j = std::clamp(r, 0, masks_.rows(level) - 1);
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      const int i = std::clamp(c0 + int(k), 0, masks_.cols(level) - 1);
      if (!(masks_.at(level, i, j) & CellMasks::kAnswering)) cells_[k] = 0;
    }
  }
  const Lattice& lattice_;
  const CellMasks& masks_;
  int n_;
  Phase phase_;
  RowUp ups_[4];
  std::pair<int, std::vector<double>> expanded_[2] = {{-9, {}}, {-9, {}}};
  Bends bends_;
  std::vector<double> hidden_, cells_;
  int hidden_row_ = -9;
  bool hidden_on_row_ = false;
};

void PatchErrors::measure(const Lattice& lattice, const Lattice& level0, std::span<const std::uint8_t> valid,
                          int y0, int y1) {
  const int level = lattice.level();
  const Positions positions(shape_.width(), shape_.pad(), level), rows(shape_.height(), shape_.pad(), level);
  const Reference reference(level0, valid, positions);
  const int first = y0 == 0 ? 0 : rows.place(y0), end = y1 == shape_.height() ? rows.n : rows.place(y1);
  for (int p0 = 0; p0 < positions.n; p0 += kStrip) {
    const int p1 = std::min(positions.n, p0 + kStrip), n = p1 - p0;
    Strip strip(lattice, cells_, positions, p0, p1);
    std::vector<double> z(static_cast<size_t>(n)), linear(z), smooth(z);
    for (int s = 0; s < levels_[size_t(level)].nj; ++s) {
      const double from = s == 0 ? -1 : segment_start(s, level), to = segment_start(s + 1, level);
      bool any = false;
      for (int row = std::max(first, from < 0 ? 0 : rows.place(int(from))); row < end && rows.at(row) <= to;
           ++row) {
        if (!any) std::fill(linear.begin(), linear.end(), 0), std::fill(smooth.begin(), smooth.end(), 0);
        any = true;
        const double y = rows.at(row), v = std::ldexp(y, -level), cell = std::floor(v);
        const int r = int(cell);
        reference.row(y, p0, p1, z.data());
        const RowUp &a = strip.up(r - 1), &b = strip.up(r), &c = strip.up(r + 1), &d = strip.up(r + 2);
        accumulate(z.data(), a, b, c, d, strip.hidden(r, v == cell), v - cell, n, linear.data(),
                   smooth.data());
      }
      if (any) note(level, s, positions, p0, p1, linear.data(), smooth.data());
    }
  }
}

void PatchErrors::note(int level, int segment, const Positions& positions, int p0, int p1,
                       const double* linear, const double* smooth) {
  Level& out = levels_[size_t(level)];
  const int across = shape_.blocks_i(level);
  const BlockSpan rows(segment, shape_.blocks_j(level));
  // Segments share their ends; the first that reaches into the strip may be the one before that of its start.
  const int start = segments(std::max(0, p0 - positions.first) / positions.per, level) - 2;
  const std::lock_guard lock(mutex_);
  for (int i = std::max(0, start); i < out.ni; ++i) {
    const int a = i == 0 ? 0 : positions.place(segment_start(i, level));
    const int b = std::min(positions.place(segment_start(i + 1, level)), positions.n - 1);
    if (a >= p1) break;
    double worst = 0, worst_smooth = 0;
    for (int p = std::max(a, p0); p <= std::min(b, p1 - 1); ++p)
      worst = std::max(worst, linear[p - p0]), worst_smooth = std::max(worst_smooth, smooth[p - p0]);
    const BlockSpan cols(i, across);
    for (int by = rows.first; by <= rows.last; ++by)
      for (int bx = cols.first; bx <= cols.last; ++bx) {
        Largest& block = out.blocks[size_t(by) * size_t(across) + size_t(bx)];
        block.linear = std::max(block.linear, float_at_least(worst));
        block.smooth = std::max(block.smooth, float_at_least(worst_smooth));
      }
  }
}

double PatchErrors::largest_departure() const {
  float largest = 0;
  for (const Largest& block : levels_[0].blocks) largest = std::max(largest, block.smooth);
  return double(largest);
}

std::array<double, 3> PatchErrors::of(int level, int bx, int by) const {
  const Largest& block =
      levels_[size_t(level)].blocks[size_t(by) * size_t(shape_.blocks_i(level)) + size_t(bx)];
  const auto counted = [](double e) {
    const double tiny = std::ldexp(1, -30);
    return e <= tiny ? 0 : e * (1 + 1e-12) + tiny;
  };
  return {counted(double(block.linear)), counted(double(block.smooth)), counted(double(block.smooth))};
}

}  // namespace patchwork
