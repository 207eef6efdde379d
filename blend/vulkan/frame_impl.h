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
  std::uint32_t explicit_points, classify, tiles;
};
static_assert(sizeof(Push) == 96);

/// common.glsl: Tally without the list behind it.
struct TallyHead {
  std::uint32_t later_groups[3], later_count, contributions, most, bound_max, outs, insides, partials;
};

/// common.glsl: Modes.
struct ModesHead {
  std::uint32_t groups[3][3], counts[3];
};

/// Planes of the results besides the height.
struct Planes {
  bool bound = true, source = true, gradient = false;
  std::size_t words() const { return 1u + bound + source + 2u * gradient; }
  int number() const { return bound | source << 1 | gradient << 2; }
};

/// The evaluator's passes for one smoothness and composition, shared by all evaluators of a device.
class Passes {
 public:
  enum Mode { copy, plain, holes, later };  ///< common.glsl: kCopy and so on
  Passes(const Device::Impl& device, int smoothness, bool priority);

  Bindings bindings;
  bool priority() const { return priority_; }
  VkPipeline classify() { return made(classify_, {}, 0); }
  /// Compiled when first asked for: it takes some 50 ms on lavapipe.
  VkPipeline evaluate(Mode mode, Planes planes) {
    return made(evaluate_[mode][planes.number()], planes, mode);
  }

 private:
  VkPipeline made(OwnedPipeline& pipeline, Planes planes, int mode);
  int smoothness_;
  bool priority_;
  OwnedPipeline classify_, evaluate_[4][8];
};

/// What a submission is made of.
struct Work {
  const TileBins* bins = nullptr;
  std::span<const double> points = {};  ///< x, y of explicit points, 64 a tile
  Push push{};
  Planes planes{};
  bool ragged = true;  ///< some patch is not PatchKind::kPlain
  std::size_t result_words = 0;
  std::size_t read_from = 0;  ///< words before that stay on the card
};

class Frame {
 public:
  Frame(const Device::Impl& device, Passes& passes, const PatchPool::Impl& pool);
  ~Frame() { commands_.abandon(); }
  /// REQUIRES: the results of the submission before are no longer needed.
  void submit(const Work& work);
  /// Waits for the submission. Throws Error: the device was lost.
  void finish();
  const TallyHead& tally() const;
  std::span<const std::uint32_t> results() const;  ///< from Work::read_from on
  /// Milliseconds: send, classify, blend, exact, read back.
  std::vector<double> times() const { return timer_.intervals(); }
  /// Whole, until the next submission.
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
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  OwnedSets sets_;
  Buffer staging_, entries_, tiles_, lists_, tally_, results_, points_, work_, modes_, readback_;
  OwnedView entry_texels_, list_texels_;
  std::size_t result_words_ = 0;
};

}  // namespace patchwork::vk
