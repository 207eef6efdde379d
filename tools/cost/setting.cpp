#include "tools/cost/setting.h"

#include <oneapi/tbb/global_control.h>

#include <algorithm>

#include "blend/vulkan/vulkan_blend.h"
#include "db/stopwatch.h"
#include "tools/resampler.h"

namespace patchwork::cli {

namespace {

RasterFrame frame(const Setting& s) {
  const double dx = (s.window.xmax - s.window.xmin) / s.side, dy = (s.window.ymax - s.window.ymin) / s.side;
  return {s.window.xmin + dx / 2, dx, 0, s.window.ymax - dy / 2, 0, -dy};
}

}  // namespace

std::unique_ptr<Evaluator> Surfaces::evaluator(const Setting& s, const Database& db,
                                               const Extraction& x) const {
  if (!s.vulkan) return std::make_unique<Blend>(db, x.patches, s.blend);
  return std::make_unique<VulkanBlend>(
      device_, db, x.patches, s.blend,
      VulkanOptions{.memory = std::max<std::uint64_t>(memory_ / 4, x.patches.size() * 16384),
                    .tile = s.tile});
}

CostRow Surfaces::facts(const Setting& s) const {
  const Extraction x = extract(*s.db, *s.cut);
  CostRow row{.knob = s.knob, .value = s.value, .unit = s.unit, .asked = s.asked};
  row.patches = x.patches.size(), row.bytes = x.cost.bytes, row.file_bytes = s.db->file_bytes();
  row.samples = double(s.side) * s.side;
  if (s.comparable) row.found = x.cost, row.expected = expect(*s.db, *s.cut, {});
  s.points->compare(*evaluator(s, *s.db, x), s.scale, s.vulkan, row);
  return row;
}

void Surfaces::once(const Setting& s, Stages& ms) const {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(s.threads));
  const Extraction x = extract(*s.db, *s.cut);
  const Database fresh = Database::open(s.db->path(), cache_);  // nothing of it is in memory yet
  const Stopwatch fetching;
  prefetch(fresh, x.patches, cache_);
  std::unique_ptr<Evaluator> surface;
  if (s.vulkan) surface = evaluator(s, fresh, x);  // what is sent to the card
  const double fetch = fetching.milliseconds();
  const Stopwatch blending;
  if (!surface) surface = evaluator(s, fresh, x);
  std::vector<float> heights(std::size_t(s.side) * std::size_t(s.side));
  surface->at_pixels(frame(s), s.side, 0, s.side,
                     {.height = {}, .bound = {}, .source = {}, .patch = {}, .height32 = heights});
  ms.query.push_back(1e3 * x.cost.seconds), ms.fetch.push_back(fetch);
  ms.blend.push_back(blending.milliseconds());
}

}  // namespace patchwork::cli
