#include "tools/resampler.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "db/error.h"
#include "db/float_rounding.h"
#include "db/stopwatch.h"

namespace patchwork::cli {

namespace {
constexpr int kStrip = 256, kStrips = 32;  // rows at least, and about how often progress is told
constexpr double kHalfUlp = 0x1p-24;       // at most, of a number in float32
}  // namespace

Raster Raster::covering(const Extent& e, double step) {
  if (!(step > 0) || !std::isfinite(step)) throw Error("step", "it must be a number of metres above 0");
  // A sliver of a pixel that rounding leaves makes no column of its own.
  const auto count = [&](double length) { return std::max(1.0, std::ceil(length / step - 1e-6)); };
  const double w = count(e.xmax - e.xmin), h = count(e.ymax - e.ymin);
  if (w > 2e9 || h > 2e9)
    throw Error("step", "the raster would be too large", "ask for a larger step or a smaller extent");
  return {e.xmin, e.ymax, step, int(w), int(h)};
}

RasterFrame Raster::frame(int factor) const {
  const double s = step * factor;
  return {xmin + 0.5 * step, s, 0, ymax - 0.5 * step, 0, -s};
}

double finest_step(const Database& db, const Extent& extent, std::span<const GridId> among) {
  double finest = INFINITY;
  const auto counts = [&](GridId id) {
    return among.empty() || std::find(among.begin(), among.end(), id) != among.end();
  };
  for (const Grid& g : db.grids())
    if (counts(g.info.id) && g.info.bounds().meets(extent))
      finest = std::min(finest, g.info.frame.finer_step());
  if (!std::isfinite(finest))
    throw Error(db.path(), "no grid meets the extent", "see its extent with: patchwork info");
  return finest;
}

Resampler::Resampler(const Evaluator& blend, const Raster& raster, std::vector<std::string> bands,
                     std::size_t memory, const std::function<void(double)>& progress)
    : blend_(blend), raster_(raster), bands_(std::move(bands)), progress_(progress) {
  const std::size_t pixels = size_t(raster.width) * size_t(raster.height);
  if (pixels > memory / 4 / (sizeof(float) * bands_.size())) return;
  for (std::size_t b = 0; b < bands_.size(); ++b) whole_.emplace_back(pixels);
}

void Resampler::rows(int factor, int row, int rows, std::span<float* const> bands) {
  const Stopwatch watch;
  if (whole_.empty()) {
    evaluate(factor, row, rows, bands);
  } else {
    std::vector<float*> planes;
    for (Buffer<float>& plane : whole_) planes.push_back(plane.data());
    if (!done_) evaluate_whole(planes);
    done_ = true;
    const int width = (raster_.width + factor - 1) / factor;
    tbb::parallel_for(0, rows, [&](int r) {
      for (std::size_t b = 0; b < bands.size(); ++b) {
        const float* from = planes[b] + size_t(row + r) * size_t(factor) * size_t(raster_.width);
        float* to = bands[b] + size_t(r) * size_t(width);
        for (int c = 0; c < width; ++c) to[c] = from[size_t(c) * size_t(factor)];
      }
    });
  }
  tally_.blend_seconds += watch.seconds();
}

void Resampler::evaluate_whole(std::span<float* const> planes) {
  const int step = std::max(kStrip, raster_.height / kStrips + 1);
  for (int row = 0; row < raster_.height; row += step) {
    const int rows = std::min(step, raster_.height - row);
    std::vector<float*> strip(planes.begin(), planes.end());
    for (float*& plane : strip) plane += std::size_t(row) * std::size_t(raster_.width);
    evaluate(1, row, rows, strip);
    if (progress_) progress_(double(row + rows) / raster_.height);
  }
}

void Resampler::evaluate(int factor, int row, int rows, std::span<float* const> bands) {
  const int width = (raster_.width + factor - 1) / factor;
  const std::size_t n = size_t(width) * size_t(rows);
  BlendOutput out;
  for (std::size_t b = 0; b < bands_.size(); ++b) {
    if (bands_[b] == "height") out.height32 = {bands[b], n};
    if (bands_[b] == "bound") bound_.resize(n), out.bound = bound_;
    if (bands_[b] == "source") source_.resize(n), out.source = source_;
  }
  const BlendCounts c = blend_.at_pixels(raster_.frame(factor), width, row, rows, out);
  for (std::size_t b = 0; b < bands_.size(); ++b) {
    if (bands[b] == out.height32.data()) continue;
    tbb::parallel_for(0, rows, [&](int r) {
      const std::size_t from = size_t(r) * size_t(width), to = from + size_t(width);
      float* f = bands[b];
      if (bands_[b] == "height")  // asked for twice
        std::copy(out.height32.begin() + long(from), out.height32.begin() + long(to), f + from);
      if (bands_[b] == "source")
        for (std::size_t k = from; k < to; ++k) f[k] = source_[k] ? float(source_[k]) : NAN;
      // A bound is rounded up, or it would not be one, and counts how its height was rounded.
      if (bands_[b] == "bound")
        for (std::size_t k = from; k < to; ++k) {
          const double rounding = out.height32.empty() ? 0 : kHalfUlp * std::abs(double(out.height32[k]));
          f[k] = float_at_least(bound_[k] + rounding);
        }
    });
  }
  if (factor > 1) return;
  tally_.full += c;
}

double prefetch(const Database& db, std::span<const PatchId> patches, std::size_t memory) {
  const Stopwatch watch;
  if (patches.size() * sizeof(PatchSurface) > memory / 32) return 0;
  // By place, not by priority: neighbours are cut from the same chunks.
  std::vector<PatchId> order(patches.begin(), patches.end());
  std::sort(order.begin(), order.end());
  tbb::parallel_for(size_t(0), order.size(), [&](std::size_t k) { db.surface(order[k]); });
  return watch.seconds();
}

}  // namespace patchwork::cli
