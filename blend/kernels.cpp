#include "blend/kernels.h"

#include "blend/weight.h"
#include "db/basis.h"
#include "db/vectorized.h"

namespace patchwork::kernels {

namespace {

constexpr int kSide = PatchSurface::kSide;

// The cell that holds a window coordinate; the far end of the window belongs to its last cell.
inline int cell_of(double u) {
  const int c = int(u);
  return c < 1 ? 1 : c > kSide - 3 ? kSide - 3 : c;
}

// Where one ramp is below 1 the opposite one is not, rounding included: one division an axis gives the
// smaller of the two (or something above 1, as it does).
template <int k>
[[gnu::always_inline]] inline void ramps(const LatticeRect& kernel, const LatticeRect& ramp,
                                         const LatticeRect& domain, const double* u, const double* v, int n,
                                         double* __restrict weight) {
  const double low_i = kernel.i0 - ramp.i0, high_i = ramp.i1 - kernel.i1;
  const double low_j = kernel.j0 - ramp.j0, high_j = ramp.j1 - kernel.j1;
  for (int p = 0; p < n; ++p) {
    const bool below_i = u[p] < kernel.i0, below_j = v[p] < kernel.j0;
    const double s = (below_i ? u[p] - ramp.i0 : ramp.i1 - u[p]) / (below_i ? low_i : high_i);
    const double t = (below_j ? v[p] - ramp.j0 : ramp.j1 - v[p]) / (below_j ? low_j : high_j);
    const double w = smoothstep<k>(s) * smoothstep<k>(t);
    const bool outside = u[p] < domain.i0 || u[p] > domain.i1 || v[p] < domain.j0 || v[p] > domain.j1;
    weight[p] = outside ? -1.0 : w;
  }
}

template <int k>
[[gnu::always_inline]] inline void wendlands(const LatticeRect& domain, const double* u, const double* v,
                                             int n, double* __restrict weight) {
  const double ci = 0.5 * (domain.i0 + domain.i1), cj = 0.5 * (domain.j0 + domain.j1);
  const double hi = 0.5 * (domain.i1 - domain.i0), hj = 0.5 * (domain.j1 - domain.j0);
  for (int p = 0; p < n; ++p) {
    const double w = wendland<k>((u[p] - ci) / hi) * wendland<k>((v[p] - cj) / hj);
    const bool outside = u[p] < domain.i0 || u[p] > domain.i1 || v[p] < domain.j0 || v[p] > domain.j1;
    weight[p] = outside ? -1.0 : w;
  }
}

[[gnu::always_inline]] inline void bilinear(const float* codes, const double* u, const double* v, int n,
                                            double* __restrict value) {
  for (int p = 0; p < n; ++p) {
    const int i = cell_of(u[p]), j = cell_of(v[p]), at = j * kSide + i;
    const double s = u[p] - i, t = v[p] - j;
    const double a = codes[at], b = codes[at + 1], c = codes[at + kSide], d = codes[at + kSide + 1];
    const double low = a + s * (b - a), high = c + s * (d - c);
    value[p] = low + t * (high - low);
  }
}

template <int k>
[[gnu::always_inline]] inline void smooth(const float* codes, const double* u, const double* v, int n,
                                          double* __restrict value) {
  for (int p = 0; p < n; ++p) {
    const int i = cell_of(u[p]), j = cell_of(v[p]);
    const CellWeights s = cell_weights<k>(u[p] - i), t = cell_weights<k>(v[p] - j);
    const int at = (j - 1) * kSide + i - 1;
    const auto row = [&](int from) {
      const double a = codes[from], b = codes[from + 1], c = codes[from + 2], d = codes[from + 3];
      return b + (s.before * (a - b) + s.far * (c - b) + s.beyond * (d - b));
    };
    const double a = row(at), b = row(at + kSide), c = row(at + 2 * kSide), d = row(at + 3 * kSide);
    value[p] = b + (t.before * (a - b) + t.far * (c - b) + t.beyond * (d - b));
  }
}

PATCHWORK_VECTORIZED void ramps0(const LatticeRect& kernel, const LatticeRect& ramp,
                                 const LatticeRect& domain, const double* u, const double* v, int n,
                                 double* weight) {
  ramps<0>(kernel, ramp, domain, u, v, n, weight);
}
PATCHWORK_VECTORIZED void ramps1(const LatticeRect& kernel, const LatticeRect& ramp,
                                 const LatticeRect& domain, const double* u, const double* v, int n,
                                 double* weight) {
  ramps<1>(kernel, ramp, domain, u, v, n, weight);
}
PATCHWORK_VECTORIZED void ramps2(const LatticeRect& kernel, const LatticeRect& ramp,
                                 const LatticeRect& domain, const double* u, const double* v, int n,
                                 double* weight) {
  ramps<2>(kernel, ramp, domain, u, v, n, weight);
}
PATCHWORK_VECTORIZED void smooth0(const float* codes, const double* u, const double* v, int n,
                                  double* value) {
  bilinear(codes, u, v, n, value);
}
PATCHWORK_VECTORIZED void smooth1(const float* codes, const double* u, const double* v, int n,
                                  double* value) {
  smooth<1>(codes, u, v, n, value);
}
PATCHWORK_VECTORIZED void smooth2(const float* codes, const double* u, const double* v, int n,
                                  double* value) {
  smooth<2>(codes, u, v, n, value);
}

}  // namespace

PATCHWORK_VECTORIZED void to_window(const WindowMap& m, const double* x, const double* y, int n,
                                    double* __restrict u, double* __restrict v) {
  for (int p = 0; p < n; ++p) {
    const double dx = x[p] - m.x0, dy = y[p] - m.y0;
    u[p] = (m.ua * dx + m.ub * dy) - m.first_i;
    v[p] = (m.va * dx + m.vb * dy) - m.first_j;
  }
}

void ramp_weights(int smoothness, const LatticeRect& kernel, const LatticeRect& ramp,
                  const LatticeRect& domain, const double* u, const double* v, int n, double* weight) {
  constexpr decltype(&ramps0) by_smoothness[] = {ramps0, ramps1, ramps2};
  by_smoothness[smoothness](kernel, ramp, domain, u, v, n, weight);
}

PATCHWORK_VECTORIZED void wendland_weights(int smoothness, const LatticeRect& domain, const double* u,
                                           const double* v, int n, double* weight) {
  if (smoothness == 0)
    wendlands<0>(domain, u, v, n, weight);
  else
    wendlands<2>(domain, u, v, n, weight);
}

void interpolate(int smoothness, const float* codes, const double* u, const double* v, int n, double* value) {
  constexpr decltype(&smooth0) by_smoothness[] = {smooth0, smooth1, smooth2};
  by_smoothness[smoothness](codes, u, v, n, value);
}

}  // namespace patchwork::kernels
