#include "render/vulkan/light_map_impl.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "query/extract.h"
#include "render/vulkan/shaders.h"

namespace patchwork::vk {

namespace {

constexpr VkDescriptorType kTypes[] = {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
                                       VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
                                       VK_DESCRIPTOR_TYPE_STORAGE_IMAGE};
constexpr int kSquare = 16;  // light.comp
// Of the samples of the relief; light from all sides changes slowly. With as many samples as that, 513 x 513,
// and 16 directions a sky map of Puget Sound took lavapipe 5.3 s (`patchwork render --stats`: light).
constexpr int kSkyStride = 4;

Texture map_of(const Device::Impl& device, std::uint32_t width, std::uint32_t height) {
  Texture t(device, {.format = VK_FORMAT_R16G16_SFLOAT,
                     .width = width,
                     .height = height,
                     .usage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT});
  Commands commands(device);
  t.change(commands.begin(), VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_GENERAL);
  commands.submit(), commands.wait();
  return t;
}

Buffer buffer_of(const Device::Impl& device, std::span<const float> values) {
  Buffer b(device, values.size_bytes(), VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, Where::upload);
  std::memcpy(b.mapped(), values.data(), values.size_bytes());
  return b;
}

double finest_step(const Database& db) {
  double finest = INFINITY;
  for (const Grid& g : db.grids()) finest = std::min({finest, g.info.frame.step_i(), g.info.frame.step_j()});
  return finest;
}

bool same(const effects::Sun& a, const effects::Sun& b) {
  return a.azimuth == b.azimuth && a.elevation == b.elevation;
}

}  // namespace

struct LightMap::Push {
  std::int32_t width, height, top, stride;
  float step;
  std::int32_t directions;
  float to_sun[2];
  float least, enough;
  std::int32_t start[12];
};

LightMap::LightMap(const Device::Impl& device)
    : device_(device),
      bindings_(device, kTypes, sizeof(Push)),
      shadow_sets_(bindings_.make_set(shadow_set_)),
      sky_sets_(bindings_.make_set(sky_set_)),
      nothing_(map_of(device, 1, 1)) {}

void LightMap::take_heights(const Database& db, int smoothness) {
  const Extent e = db.extent();
  const double longest = std::max(e.xmax - e.xmin, e.ymax - e.ymin);
  const int side = std::clamp(int(longest / finest_step(db)) + 1, 2, kSide);
  const Extraction x = extract(db, {.error = 0.1 * longest / side});
  relief_ = effects::Relief::of(Blend(db, x.patches, {.smoothness = smoothness}), e, side);
  const std::vector<float> steepest = relief_->steepest(kSquare);
  steepest_ = double(*std::max_element(steepest.begin(), steepest.end()));
  relief_buffer_ = buffer_of(device_, relief_->levels());
  relief_texels_ = texels(device_, relief_buffer_, VK_FORMAT_R32_SFLOAT);
  steepest_buffer_ = buffer_of(device_, steepest);
  steepest_texels_ = texels(device_, steepest_buffer_, VK_FORMAT_R32_SFLOAT);
  sun_.reset(), sky_.reset();
  ++generation_;
}

LightMap::Push LightMap::push_for(int stride) const {
  Push p{
      relief_->width(), relief_->height(), relief_->top(), stride, float(relief_->step()), 0, {}, 0, 0, {}};
  for (int l = 0; l <= relief_->top(); ++l) p.start[l] = std::int32_t(relief_->start(l));
  return p;
}

Texture LightMap::make_map(int stride) const {
  const auto texels_of = [&](int samples) { return std::uint32_t((samples - 1) / stride + 1); };
  return map_of(device_, texels_of(relief_->width()), texels_of(relief_->height()));
}

void LightMap::dispatch(VkCommandBuffer c, bool sky, const Texture& map, const Push& push) {
  OwnedPipeline& pipeline = sky ? sky_pipeline_ : shadow_pipeline_;
  const std::uint32_t constants[] = {sky};
  if (!pipeline) pipeline = make_pipeline(bindings_, shaders::light(), constants);
  const VkDescriptorSet set = sky ? sky_set_ : shadow_set_;
  bindings_.bind(set, 0, relief_texels_), bindings_.bind(set, 1, steepest_texels_);
  bindings_.bind(set, 2, VK_NULL_HANDLE, map.view(), VK_IMAGE_LAYOUT_GENERAL);
  vkCmdBindPipeline(c, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.get());
  vkCmdBindDescriptorSets(c, VK_PIPELINE_BIND_POINT_COMPUTE, bindings_.layout(), 0, 1, &set, 0, nullptr);
  vkCmdPushConstants(c, bindings_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
  vkCmdDispatch(c, (map.shape().width + 7) / 8, (map.shape().height + 7) / 8, 1);
  barrier(c);
}

void LightMap::record(VkCommandBuffer c, const std::optional<effects::Sun>& sun,
                      const std::optional<effects::Shadow>& shadow, const std::optional<effects::Sky>& sky) {
  if (shadow && (!sun_ || !made_for_ || !same(*made_for_, *sun) || softness_ != shadow->softness)) {
    if (!sun_) sun_ = make_map(1), ++generation_;
    Push p = push_for(1);
    const double half = 0.5 * shadow->softness, azimuth = sun->azimuth * kDegree;
    p.to_sun[0] = float(std::sin(azimuth)), p.to_sun[1] = float(std::cos(azimuth));
    p.least = float(std::tan((sun->elevation - half) * kDegree));
    p.enough = float(std::tan(std::min(89.9, sun->elevation + half) * kDegree)) + 1e-3f;
    dispatch(c, false, *sun_, p), ++shadow_dispatches;
    made_for_ = sun, softness_ = shadow->softness;
  }
  if (sky && (!sky_ || directions_ != sky->directions)) {
    if (!sky_) sky_ = make_map(kSkyStride), ++generation_;
    Push p = push_for(kSkyStride);
    p.directions = sky->directions, p.least = float(effects::lowest_direction(*sky));
    dispatch(c, true, *sky_, p), ++sky_dispatches;
    directions_ = sky->directions;
  }
}

}  // namespace patchwork::vk
