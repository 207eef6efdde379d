#include <algorithm>
#include <cstring>

#include "blend/vulkan/frame_impl.h"
#include "blend/vulkan/shaders.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr VkDescriptorType kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
// In the order of common.glsl; binding 10 is classify.comp's.
constexpr VkDescriptorType kTypes[] = {kTexels,  kTexels,  kTexels,  kStorage, kTexels,  kStorage, kTexels,
                                       kStorage, kStorage, kStorage, kStorage, kStorage, kStorage};
constexpr std::uint32_t kMarks = 6;

// Room to grow: the next submission is often a little larger.
bool make_larger(const Device::Impl& device, Buffer& buffer, std::size_t bytes, VkBufferUsageFlags usage,
                 Where where) {
  if (buffer.bytes() >= bytes && buffer.get()) return false;
  buffer = Buffer();
  buffer = Buffer(device, bytes + bytes / 4, usage, where);
  return true;
}

}  // namespace

Passes::Passes(const Device::Impl& device, int smoothness, bool priority)
    : bindings(device, kTypes, sizeof(Push)), smoothness_(smoothness), priority_(priority) {}

VkPipeline Passes::made(OwnedPipeline& pipeline, Planes planes, int mode) {
  const std::uint32_t constants[] = {
      std::uint32_t(smoothness_), priority_, planes.gradient, planes.bound, planes.source,
      std::uint32_t(mode)};
  if (pipeline) return pipeline.get();
  const auto shader = &pipeline == &classify_ ? shaders::classify()
                      : mode == later         ? shaders::exact()
                                              : shaders::blend();
  pipeline = make_pipeline(bindings, shader, constants);
  return pipeline.get();
}

Frame::Frame(const Device::Impl& device, Passes& passes, const PatchPool::Impl& pool)
    : device_(device),
      passes_(passes),
      pool_(pool),
      commands_(device),
      timer_(device, kMarks),
      sets_(passes.bindings.make_set(set_)) {}

// Buffers only grow. A view goes before its buffer does, and the set is written anew when either is another
// one; the frame's last submission has ended by then.
void Frame::grow(const Work& work) {
  const TileBins& bins = *work.bins;
  const std::size_t entries = bins.entries.size() * sizeof(TileEntry);
  const std::size_t tiles = bins.tiles.size() * sizeof(TileHeader), points = work.points.size_bytes();
  const std::size_t results = work.result_words * 4, tally = sizeof(TallyHead) + results;
  constexpr VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  constexpr VkBufferUsageFlags texel = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
  bool changed = entry_texels_.get() == VK_NULL_HANDLE;
  make_larger(device_, staging_, entries + tiles + points, 0, Where::upload);
  make_larger(device_, readback_, sizeof(TallyHead) + results, 0, Where::readback);
  changed |= make_larger(device_, tiles_, tiles, storage, Where::card);
  changed |= make_larger(device_, points_, points, storage, Where::card);
  changed |= make_larger(device_, tally_, tally, storage | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT, Where::card);
  changed |= make_larger(device_, modes_, sizeof(ModesHead), storage | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT,
                         Where::card);
  changed |= make_larger(device_, work_, bins.tiles.size() * work.push.blocks * work.push.blocks * 12,
                         storage, Where::card);
  changed |= make_larger(device_, results_, results, storage | texel, Where::card);
  if (entries_.bytes() < entries || !entries_.get()) entry_texels_ = OwnedView();
  if (make_larger(device_, entries_, entries, texel, Where::card))
    entry_texels_ = texels(device_, entries_, VK_FORMAT_R32G32B32A32_SFLOAT), changed = true;
  if (lists_.bytes() < bins.lists * 4 || !lists_.get()) list_texels_ = OwnedView();
  if (make_larger(device_, lists_, bins.lists * 4, texel | storage, Where::card))
    list_texels_ = texels(device_, lists_, VK_FORMAT_R32_UINT), changed = true;
  if (changed) bind_all();
}

void Frame::bind_all() {
  const Bindings& b = passes_.bindings;
  b.bind(set_, 0, pool_.sample_texels), b.bind(set_, 1, pool_.word_texels);
  b.bind(set_, 2, pool_.record_texels), b.bind(set_, 3, pool_.exact);
  b.bind(set_, 4, entry_texels_), b.bind(set_, 5, tiles_), b.bind(set_, 6, list_texels_);
  b.bind(set_, 7, results_), b.bind(set_, 8, tally_), b.bind(set_, 9, points_), b.bind(set_, 10, lists_);
  b.bind(set_, 11, work_), b.bind(set_, 12, modes_);
}

// One staging buffer for everything that the host prepared; the counters start at 0, their dispatches at 0 x
// 1 x 1.
void Frame::stage(const Work& work, VkCommandBuffer commands) {
  VkDeviceSize used = 0;
  const auto send = [&](const Buffer& to, auto items) {
    if (items.empty()) return;
    std::memcpy(staging_.mapped() + used, items.data(), items.size_bytes());
    const VkBufferCopy copy{used, 0, items.size_bytes()};
    vkCmdCopyBuffer(commands, staging_.get(), to.get(), 1, &copy);
    used += items.size_bytes();
  };
  send(entries_, std::span(work.bins->entries)), send(tiles_, std::span(work.bins->tiles));
  send(points_, work.points);
  TallyHead head{};
  head.later_groups[1] = head.later_groups[2] = 1;
  vkCmdUpdateBuffer(commands, tally_.get(), 0, sizeof head, &head);
  ModesHead modes{};
  for (auto& groups : modes.groups) groups[1] = groups[2] = 1;
  vkCmdUpdateBuffer(commands, modes_.get(), 0, sizeof modes, &modes);
}

// Modes that no block can have are left out, so that their pipelines are not even made.
void Frame::record(const Work& work, VkCommandBuffer commands) {
  const auto use = [&](VkPipeline pipeline) {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
  };
  // How many groups there are only the card knows.
  const auto run = [&](Passes::Mode mode) {
    use(passes_.evaluate(mode, work.planes));
    const bool later = mode == Passes::later;
    vkCmdDispatchIndirect(commands, (later ? tally_ : modes_).get(),
                          later ? 0 : mode * sizeof(std::uint32_t[3]));
  };
  const auto next = [&] { timer_.mark(commands), barrier(commands); };
  const std::uint32_t tiles = std::uint32_t(work.bins->tiles.size()), blocks = work.push.blocks;
  const VkPipelineLayout layout = passes_.bindings.layout();
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set_, 0, nullptr);
  vkCmdPushConstants(commands, layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(Push), &work.push);
  next();
  if (work.push.explicit_points) {
    next(), next();
    use(passes_.evaluate(Passes::later, work.planes));
    vkCmdDispatch(commands, tiles, 1, 1);
    return next();
  }
  use(passes_.classify());
  vkCmdDispatch(commands, (tiles * blocks * blocks + 63) / 64, 1, 1);
  next();
  if (work.push.classify && passes_.priority()) run(Passes::copy);
  run(Passes::plain);
  if (work.ragged) run(Passes::holes);
  next();
  run(Passes::later);
  next();
}

// send | classify | blend | exact | read back: a mark stands between any two.
void Frame::submit(const Work& work) {
  const VkCommandBuffer commands = commands_.begin();
  grow(work);
  result_words_ = work.result_words - work.read_from;
  timer_.reset(commands);
  timer_.mark(commands);
  barrier(commands);
  stage(work, commands);
  record(work, commands);
  const VkBufferCopy head{0, 0, sizeof(TallyHead)};
  const VkBufferCopy all{work.read_from * 4, sizeof(TallyHead), result_words_ * 4};
  vkCmdCopyBuffer(commands, tally_.get(), readback_.get(), 1, &head);
  if (all.size > 0) vkCmdCopyBuffer(commands, results_.get(), readback_.get(), 1, &all);
  timer_.mark(commands);
  barrier(commands);
  commands_.submit();
}

void Frame::finish() { commands_.wait(); }

const TallyHead& Frame::tally() const { return *reinterpret_cast<const TallyHead*>(readback_.mapped()); }

std::span<const std::uint32_t> Frame::results() const {
  return {reinterpret_cast<const std::uint32_t*>(readback_.mapped() + sizeof(TallyHead)), result_words_};
}

}  // namespace patchwork::vk
