// Bindings and compute pipelines: a shader with its constants, and what is bound to it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "blend/vulkan/buffer_impl.h"

namespace patchwork::vk {

/// The bindings that all shaders of the family share, in their order in common.glsl.
class Bindings {
 public:
  /// One element a binding, of any type of buffer, texel buffer or image; seen by `stages`.
  Bindings(const Device::Impl& device, std::span<const VkDescriptorType> types, std::uint32_t push_bytes,
           VkShaderStageFlags stages = VK_SHADER_STAGE_COMPUTE_BIT);
  /// A pool of one descriptor set.
  OwnedSets make_set(VkDescriptorSet& set) const;
  /// REQUIRES: nothing that was submitted with the set still runs.
  void bind(VkDescriptorSet set, std::uint32_t binding, const Buffer& buffer) const;
  void bind(VkDescriptorSet set, std::uint32_t binding, const OwnedView& view) const;
  void bind(VkDescriptorSet set, std::uint32_t binding, VkSampler sampler, VkImageView view,
            VkImageLayout layout) const;
  VkPipelineLayout layout() const { return layout_.get(); }
  const Device::Impl& device() const { return device_; }

 private:
  const Device::Impl& device_;
  void write(VkDescriptorSet set, std::uint32_t binding, VkWriteDescriptorSet what) const;
  std::vector<VkDescriptorType> types_;
  OwnedSetLayout set_layout_;
  OwnedLayout layout_;
};

OwnedShader make_shader(const Device::Impl& device, std::span<const std::uint32_t> code);

/// `constants`: specialization constants 0, 1, ...
OwnedPipeline make_pipeline(const Bindings& bindings, std::span<const std::uint32_t> shader,
                            std::span<const std::uint32_t> constants);

/// Milliseconds between marks of one submission.
class Timer {
 public:
  Timer(const Device::Impl& device, std::uint32_t marks);
  void reset(VkCommandBuffer commands);
  void mark(VkCommandBuffer commands);
  /// Differences of successive marks, milliseconds. REQUIRES: the submission has ended.
  std::vector<double> intervals() const;

 private:
  const Device::Impl& device_;
  OwnedQueries queries_;
  std::uint32_t marks_, next_ = 0;
};

}  // namespace patchwork::vk
