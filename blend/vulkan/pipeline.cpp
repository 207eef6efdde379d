#include <cassert>

#include "blend/vulkan/pipeline_impl.h"

namespace patchwork::vk {

namespace {

// One descriptor a binding.
OwnedSetLayout make_set_layout(const Device::Impl& device, std::span<const VkDescriptorType> types,
                               VkShaderStageFlags stages) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (std::uint32_t b = 0; b < types.size(); ++b) bindings.push_back({b, types[b], 1, stages, nullptr});
  VkDescriptorSetLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  info.bindingCount = std::uint32_t(bindings.size()), info.pBindings = bindings.data();
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  device.check(vkCreateDescriptorSetLayout(device.get(), &info, nullptr, &layout), "describing bindings");
  return OwnedSetLayout(device.get(), layout);
}

OwnedLayout make_layout(const Device::Impl& device, VkDescriptorSetLayout set, std::uint32_t push_bytes,
                        VkShaderStageFlags stages) {
  const VkPushConstantRange push{stages, 0, push_bytes};
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = 1, info.pSetLayouts = &set;
  info.pushConstantRangeCount = push_bytes > 0, info.pPushConstantRanges = &push;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  device.check(vkCreatePipelineLayout(device.get(), &info, nullptr, &layout), "describing a pipeline");
  return OwnedLayout(device.get(), layout);
}

// Room for one set.
OwnedSets make_pool(const Device::Impl& device, std::span<const VkDescriptorType> types) {
  std::vector<VkDescriptorPoolSize> sizes;
  for (const VkDescriptorType t : types) sizes.push_back({t, 1});
  VkDescriptorPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO, info.maxSets = 1;
  info.poolSizeCount = std::uint32_t(sizes.size()), info.pPoolSizes = sizes.data();
  VkDescriptorPool pool = VK_NULL_HANDLE;
  device.check(vkCreateDescriptorPool(device.get(), &info, nullptr, &pool), "making a descriptor pool");
  return OwnedSets(device.get(), pool);
}

}  // namespace

OwnedShader make_shader(const Device::Impl& device, std::span<const std::uint32_t> code) {
  VkShaderModuleCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  info.codeSize = code.size_bytes(), info.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  device.check(vkCreateShaderModule(device.get(), &info, nullptr, &module), "loading a shader");
  return OwnedShader(device.get(), module);
}

Bindings::Bindings(const Device::Impl& device, std::span<const VkDescriptorType> types,
                   std::uint32_t push_bytes, VkShaderStageFlags stages)
    : device_(device),
      types_(types.begin(), types.end()),
      set_layout_(make_set_layout(device, types, stages)),
      layout_(make_layout(device, set_layout_.get(), push_bytes, stages)) {}

OwnedSets Bindings::make_set(VkDescriptorSet& set) const {
  OwnedSets pool = make_pool(device_, types_);
  const VkDescriptorSetLayout layout = set_layout_.get();
  VkDescriptorSetAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  info.descriptorPool = pool.get(), info.descriptorSetCount = 1, info.pSetLayouts = &layout;
  device_.check(vkAllocateDescriptorSets(device_.get(), &info, &set), "making a descriptor set");
  return pool;
}

void Bindings::write(VkDescriptorSet set, std::uint32_t binding, VkWriteDescriptorSet what) const {
  what.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
  what.dstSet = set, what.dstBinding = binding, what.descriptorCount = 1;
  what.descriptorType = types_[binding];
  vkUpdateDescriptorSets(device_.get(), 1, &what, 0, nullptr);
}

void Bindings::bind(VkDescriptorSet set, std::uint32_t binding, const Buffer& buffer) const {
  const VkDescriptorBufferInfo info{buffer.get(), 0, VK_WHOLE_SIZE};
  VkWriteDescriptorSet what{};
  what.pBufferInfo = &info;
  write(set, binding, what);
}

void Bindings::bind(VkDescriptorSet set, std::uint32_t binding, const OwnedView& view) const {
  assert(types_[binding] == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER);
  const VkBufferView texels = view.get();
  VkWriteDescriptorSet what{};
  what.pTexelBufferView = &texels;
  write(set, binding, what);
}

void Bindings::bind(VkDescriptorSet set, std::uint32_t binding, VkSampler sampler, VkImageView view,
                    VkImageLayout layout) const {
  const VkDescriptorImageInfo info{sampler, view, layout};
  VkWriteDescriptorSet what{};
  what.pImageInfo = &info;
  write(set, binding, what);
}

// The module is only needed until the pipeline is made. Booleans are specialized as 32-bit words like
// numbers.
OwnedPipeline make_pipeline(const Bindings& bindings, std::span<const std::uint32_t> shader,
                            std::span<const std::uint32_t> constants) {
  const Device::Impl& device = bindings.device();
  const OwnedShader module = make_shader(device, shader);
  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t c = 0; c < constants.size(); ++c) entries.push_back({c, c * 4, 4});
  const VkSpecializationInfo special{std::uint32_t(entries.size()), entries.data(), constants.size_bytes(),
                                     constants.data()};
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO, info.layout = bindings.layout();
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT, info.stage.module = module.get();
  info.stage.pName = "main", info.stage.pSpecializationInfo = &special;
  VkPipeline pipeline = VK_NULL_HANDLE;
  device.check(vkCreateComputePipelines(device.get(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline),
               "making a pipeline");
  return OwnedPipeline(device.get(), pipeline);
}

Timer::Timer(const Device::Impl& device, std::uint32_t marks) : device_(device), marks_(marks) {
  VkQueryPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  info.queryType = VK_QUERY_TYPE_TIMESTAMP, info.queryCount = marks;
  VkQueryPool pool = VK_NULL_HANDLE;
  device.check(vkCreateQueryPool(device.get(), &info, nullptr, &pool), "making timers");
  queries_ = OwnedQueries(device.get(), pool);
}

void Timer::reset(VkCommandBuffer commands) {
  vkCmdResetQueryPool(commands, queries_.get(), 0, marks_);
  next_ = 0;
}

void Timer::mark(VkCommandBuffer commands) {
  assert(next_ < marks_);
  vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_.get(), next_++);
}

// Ticks are of the device: its properties say how many nanoseconds one takes.
std::vector<double> Timer::intervals() const {
  std::vector<std::uint64_t> ticks(next_);
  if (next_ < 2) return {};
  device_.check(vkGetQueryPoolResults(device_.get(), queries_.get(), 0, next_, ticks.size() * 8, ticks.data(),
                                      8, VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                "reading timers");
  std::vector<double> all;
  const double tick = 1e-6 * double(device_.properties.limits.timestampPeriod);
  for (std::size_t k = 1; k < ticks.size(); ++k) all.push_back(double(ticks[k] - ticks[k - 1]) * tick);
  return all;
}

}  // namespace patchwork::vk
