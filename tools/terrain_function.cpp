#include "tools/terrain_function.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "db/error.h"

namespace patchwork {

namespace {

constexpr std::size_t kChunk = 256;  // points worked on at once: all arrays stay in the first-level cache
constexpr double kFinestWave = 12;   // metres
constexpr int kMaxOctaves = 14;
constexpr double kGain = 0.5;            // amplitude from one octave to the next: equal slopes at every scale
constexpr double kCrestRounding = 4e-4;  // square of the noise value below which a crest is rounded
constexpr double kLakeLevel = 200;       // metres
constexpr double kPlainLevel = 5;        // metres above the lake
constexpr double kLakeDepth = 60;        // metres of the basin that the water hides
constexpr double kLargestLattice = 0x1p30;  // cells; keeps lattice coordinates of all octaves in 32 bits

double smoothstep(double t) {
  t = std::clamp(t, 0., 1.);
  return t * t * (3 - 2 * t);
}

void check(const TerrainParameters& p) {
  const Extent& e = p.extent;
  const double width = e.xmax - e.xmin, height = e.ymax - e.ymin;
  if (!(width > 0 && height > 0) || !std::isfinite(width + height))
    throw Error("terrain", "its extent is empty or not finite", "give an extent of some metres");
  if (!(p.relief >= 0 && p.cliff >= 0) || !std::isfinite(p.relief + p.cliff))
    throw Error("terrain", "relief and cliff height must be finite and not negative");
}

}  // namespace

// Some points, relative to the extent's corner, on their way to heights.
struct TerrainFunction::Chunk {
  std::size_t n = 0;
  std::array<double, kChunk> x, y, noise, height;

  void evaluate(const NoiseOctave& octave) { octave.values({x.data(), n}, {y.data(), n}, {noise.data(), n}); }
};

TerrainFunction::TerrainFunction(const TerrainParameters& parameters) : parameters_(parameters) {
  check(parameters_);
  const Extent& e = parameters_.extent;
  const std::uint32_t seed = parameters_.seed;
  const double width = e.xmax - e.xmin, height = e.ymax - e.ymin, size = std::max(width, height);
  double wave = size / 3, amplitude = 1, sum = 0;
  for (int o = 0; o < kMaxOctaves && (o == 0 || wave >= kFinestWave); ++o, wave /= 2, amplitude *= kGain) {
    ridges_.push_back({1 / wave, hash_lattice(o, 1, seed)});
    sum += amplitude;
  }
  ridge_scale_ = parameters_.relief / sum;
  reach_ = kLargestLattice * std::min(kFinestWave, size / 4);
  plains_ = {2 / size, hash_lattice(0, 2, seed)};
  // The shape's gradient is at most about 2 / wavelength, which turns a thickness in metres into a width.
  const auto cliff = [&](int n, double level, double thickness, double share) {
    const double frequency = 4 / size;
    cliffs_.push_back(
        {{frequency, hash_lattice(n, 3, seed)}, level, 2 * frequency * thickness, share * parameters_.cliff});
  };
  if (parameters_.cliff > 0) cliff(0, 0.1, 1, 1), cliff(1, -0.05, 15, 1.5);
  lake_ = {{e.xmin + width * (0.25 + 0.5 * hash_unit(0, 4, seed)),
            e.ymin + height * (0.25 + 0.5 * hash_unit(1, 4, seed))},
           std::min(width, height) / 10,
           kLakeLevel};
}

double TerrainFunction::height(double x, double y) const {
  double h = 0;
  heights({&x, 1}, {&y, 1}, {&h, 1});
  return h;
}

void TerrainFunction::heights(std::span<const double> x, std::span<const double> y,
                              std::span<double> out) const {
  Chunk chunk;
  for (std::size_t start = 0; start < out.size(); start += kChunk) {
    chunk.n = std::min(kChunk, out.size() - start);
    for (std::size_t k = 0; k < chunk.n; ++k) {
      chunk.x[k] = std::clamp(x[start + k] - parameters_.extent.xmin, -reach_, reach_);
      chunk.y[k] = std::clamp(y[start + k] - parameters_.extent.ymin, -reach_, reach_);
    }
    add_mountains(chunk);
    add_cliffs(chunk);
    sink_lake(chunk);
    std::copy_n(chunk.height.begin(), chunk.n, out.begin() + std::ptrdiff_t(start));
  }
}

// Musgrave's ridged multifractal: each octave is a crest where its noise is 0, squared to sharpen it, and
// weighted by the octave before, so that valleys stay smooth. Where the plains' noise is low the mountains
// are taken off.
void TerrainFunction::add_mountains(Chunk& chunk) const {
  std::array<double, kChunk> rise, weight, sum{};
  chunk.evaluate(plains_);
  double highest = 0;
  for (std::size_t k = 0; k < chunk.n; ++k) {
    rise[k] = smoothstep((chunk.noise[k] + 0.15) * 2.5);
    highest = std::max(highest, rise[k]);
  }
  weight.fill(1);
  double amplitude = highest > 0 ? ridge_scale_ : 0;
  // In a chunk of nothing but plains the octaves would be multiplied by 0.
  for (auto octave = ridges_.begin(); amplitude > 0 && octave != ridges_.end(); ++octave) {
    chunk.evaluate(*octave);
    for (std::size_t k = 0; k < chunk.n; ++k) {
      const double n = chunk.noise[k];
      const double crest = std::max(0., 1 - std::sqrt(n * n + kCrestRounding));
      const double signal = crest * crest * weight[k];
      sum[k] += amplitude * signal;
      weight[k] = std::min(1., 1.5 * signal);
    }
    amplitude *= kGain;
  }
  for (std::size_t k = 0; k < chunk.n; ++k) chunk.height[k] = kPlainLevel + sum[k] * rise[k];
}

void TerrainFunction::add_cliffs(Chunk& chunk) const {
  for (const Cliff& cliff : cliffs_) {
    chunk.evaluate(cliff.shape);
    for (std::size_t k = 0; k < chunk.n; ++k)
      chunk.height[k] += cliff.height * smoothstep((chunk.noise[k] - cliff.level) / cliff.width);
  }
}

// Everything so far lies above the lake; a bowl pulls the ground below it, and the water fills the bowl.
void TerrainFunction::sink_lake(Chunk& chunk) const {
  const double cx = lake_.centre.x - parameters_.extent.xmin, cy = lake_.centre.y - parameters_.extent.ymin;
  for (std::size_t k = 0; k < chunk.n; ++k) {
    const double dx = chunk.x[k] - cx, dy = chunk.y[k] - cy;
    const double bowl = smoothstep(2 - 2 * std::sqrt(dx * dx + dy * dy) / lake_.radius);
    chunk.height[k] = lake_.level + std::max(0., chunk.height[k] * (1 - bowl) - kLakeDepth * bowl);
  }
}

}  // namespace patchwork
