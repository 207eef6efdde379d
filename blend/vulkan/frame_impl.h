// One submission of the evaluator: its buffers, its commands, its results.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "blend/vulkan/patch_pool_impl.h"
#include "blend/vulkan/pipeline_impl.h"
#include "blend/vulkan/tile_binning.h"

namespace patchwork::vk {

/// common.glsl: Push.
struct Push {
  double x0, xc, xr, y0, yc, yr, base;
  std::uint32_t side, blocks, bound_at, source_at, gradient_at;
  float strict_error;
  std::uint32_t explicit_points, classify, exact_rim, unused;
};
static_assert(sizeof(Push) == 96);

/// common.glsl: Tally without the list behind it.
struct TallyHead {
  std::uint32_t groups, one_y, one_z, later_count, contributions, most, bound_max, outs, insides, partials;
};

/// The evaluator's three passes for one smoothness and composition.
struct Passes {
  Passes(const Device::Impl& device, int smoothness, bool priority, bool gradient);
  Bindings bindings;
  OwnedPipeline classify, blend, exact;
};

/// What a submission is made of.
struct Work {
  const TileBins* bins = nullptr;
  std::span<const double> points = {};  ///< x, y of explicit points, 64 a tile
  Push push{};
  std::size_t result_words = 0;
};

class Frame {
 public:
  Frame(const Device::Impl& device, Passes& passes, const PatchPool::Impl& pool);
  /// REQUIRES: the results of the submission before are no longer needed.
  void submit(const Work& work);
  /// Waits for the submission. Throws Error: the device was lost.
  void finish();
  const TallyHead& tally() const;
  std::span<const std::uint32_t> results() const;
  /// Milliseconds: send, classify, blend, exact, read back.
  std::vector<double> times() const { return timer_.intervals(); }
  const Buffer& results_on_card() const { return results_; }

 private:
  void grow(const Work& work);
  void stage(const Work& work, VkCommandBuffer commands);
  void record(const Work& work, VkCommandBuffer commands);
  void bind_all();

  const Device::Impl& device_;
  Passes& passes_;
  const PatchPool::Impl& pool_;
  Commands commands_;
  Timer timer_;
  VkDescriptorSet set_;
  Buffer staging_, entries_, tiles_, lists_, tally_, results_, points_, readback_;
  OwnedView entry_texels_, list_texels_;
  std::size_t result_words_ = 0;
};

}  // namespace patchwork::vk
