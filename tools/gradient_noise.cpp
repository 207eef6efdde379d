#include "tools/gradient_noise.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace patchwork {

namespace {

constexpr std::size_t kChunk = 256;  // points placed at once: the arrays stay in the first-level cache

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

// Points in lattice coordinates: the cell, the place in it, and the blending weights. Kept apart from the
// gradients because this part has no branches and compilers vectorise it.
struct Placed {
  std::int32_t i[kChunk], j[kChunk];
  double u[kChunk], v[kChunk], fu[kChunk], fv[kChunk];

  static void split(const double* at, double frequency, std::size_t n, std::int32_t* cell, double* t,
                    double* f) {
    for (std::size_t k = 0; k < n; ++k) {
      const double scaled = at[k] * frequency;
      // Truncation and a correction: std::floor is a library call on plain x86-64.
      const double truncated = double(std::int32_t(scaled));
      const double floor = truncated - (scaled < truncated ? 1. : 0.);
      cell[k] = std::int32_t(floor);
      t[k] = scaled - floor;
      f[k] = fade(t[k]);
    }
  }
};

// The gradients at the corners of one lattice cell: (0,0), (0,1), (1,0), (1,1).
class CornerGradients {
 public:
  explicit CornerGradients(std::uint32_t seed) : seed_(seed) {}

  void move_to(std::int32_t i, std::int32_t j) {
    if (j != j_) {
      south_ = row_key(j, seed_), north_ = row_key(std::int64_t{j} + 1, seed_);
      load(0, i);
    } else if (std::int64_t{i_} + 1 == i) {  // the next cell of the row: half of the corners are known
      gx_[0] = gx_[2], gy_[0] = gy_[2], gx_[1] = gx_[3], gy_[1] = gy_[3];
    } else {
      load(0, i);
    }
    load(2, std::int64_t{i} + 1);
    i_ = i, j_ = j;
  }
  double value(double u, double v, double fu, double fv) const {
    const double a = gx_[0] * u + gy_[0] * v, b = gx_[2] * (u - 1) + gy_[2] * v;
    const double c = gx_[1] * u + gy_[1] * (v - 1), d = gx_[3] * (u - 1) + gy_[3] * (v - 1);
    const double south = a + fu * (b - a), north = c + fu * (d - c);
    return south + fv * (north - south);
  }

 private:
  void load(int corner, std::int64_t i) {
    for (const std::uint32_t key : {south_, north_}) {
      const std::uint32_t h = mix(std::uint32_t(i) * 0x9e3779b1u ^ key);
      gx_[corner] = double(std::int32_t(h & 0xffff)) * (2 / 65535.) - 1;
      gy_[corner++] = double(std::int32_t(h >> 16)) * (2 / 65535.) - 1;
    }
  }

  std::uint32_t seed_, south_ = 0, north_ = 0;
  std::int32_t i_ = 0, j_ = std::numeric_limits<std::int32_t>::min();  // a row that no point lies in
  double gx_[4]{}, gy_[4]{};
};

}  // namespace

void NoiseOctave::values(std::span<const double> x, std::span<const double> y, std::span<double> out) const {
  CornerGradients corners(seed);
  Placed at;
  for (std::size_t start = 0; start < out.size(); start += kChunk) {
    const std::size_t n = std::min(kChunk, out.size() - start);
    Placed::split(x.data() + start, frequency, n, at.i, at.u, at.fu);
    Placed::split(y.data() + start, frequency, n, at.j, at.v, at.fv);
    for (std::size_t k = 0; k < n;) {
      corners.move_to(at.i[k], at.j[k]);
      std::size_t end = k + 1;
      while (end < n && at.i[end] == at.i[k] && at.j[end] == at.j[k]) ++end;
      const CornerGradients here = corners;  // a copy that the output cannot alias
      for (; k < end; ++k) out[start + k] = here.value(at.u[k], at.v[k], at.fu[k], at.fv[k]);
    }
  }
}

}  // namespace patchwork
