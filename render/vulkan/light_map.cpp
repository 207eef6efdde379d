#include "render/vulkan/light_map_impl.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "db/stopwatch.h"
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
constexpr int kBlock = 128;  // samples a side that are taken at once

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
  for (const Grid& g : db.grids()) finest = std::min(finest, g.info.frame.finer_step());
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
  std::int32_t region[4];
};

LightRect LightRect::with(const LightRect& o) const {
  if (empty() || o.empty()) return empty() ? o : *this;
  return {std::min(x0, o.x0), std::min(y0, o.y0), std::max(x1, o.x1), std::max(y1, o.y1)};
}

LightRect LightRect::inside(int width, int height) const {
  return {std::max(x0, 0), std::max(y0, 0), std::min(x1, width), std::min(y1, height)};
}

int LightMap::Heights::across() const { return (shape.width - 1) / kBlock + 1; }

LightRect LightMap::Heights::block(std::size_t b) const {
  const int x = int(b) % across() * kBlock, y = int(b) / across() * kBlock;
  return LightRect{x, y, x + kBlock, y + kBlock}.inside(shape.width, shape.height);
}

LightMap::LightMap(const Device::Impl& device)
    : device_(device),
      bindings_(device, kTypes, sizeof(Push)),
      shadow_sets_(bindings_.make_set(shadow_set_)),
      sky_sets_(bindings_.make_set(sky_set_)),
      nothing_(map_of(device, 1, 1)),
      sun_{1},
      sky_{kSkyStride} {}

std::size_t LightMap::samples_left() const {
  std::size_t n = 0;
  for (std::size_t b = 0; heights_ && b < heights_->missing.size(); ++b)
    if (heights_->missing[b]) n += heights_->block(b).area();
  return n;
}

void LightMap::take_heights(const Database& db, int smoothness, double ms) {
  if (db.grids().empty()) return;
  const Stopwatch watch;
  const Extent e = db.extent();
  const double longest = std::max(e.xmax - e.xmin, e.ymax - e.ymin);
  const int side = int(std::clamp(longest / finest_step(db) + 1, 2., double(kSide)));
  const effects::ReliefShape shape = effects::ReliefShape::over(e, side);
  if (!heights_ || !(heights_->shape == shape)) {
    heights_ =
        Heights{shape, std::vector<float>(std::size_t(shape.width) * std::size_t(shape.height)), {}, {}};
    heights_->missing.assign(std::size_t(heights_->across()) * std::size_t((shape.height - 1) / kBlock + 1),
                             true);
  }
  std::vector<bool>& missing = heights_->missing;
  for (std::size_t b = 0; b < missing.size(); ++b) {
    if (!missing[b]) continue;
    if (watch.milliseconds() > ms) return;
    take_block(db, smoothness, 0.1 * longest / side, b);
    missing[b] = false;
  }
  const bool other = !relief_ || !(relief_->shape() == shape);
  if (other || !heights_->changed.empty()) use_heights();
}

void LightMap::take_block(const Database& db, int smoothness, double error, std::size_t b) {
  const effects::ReliefShape& s = heights_->shape;
  const LightRect r = heights_->block(b);
  const double x = s.first.x + r.x0 * s.step, y = s.first.y + r.y0 * s.step;
  const int width = r.x1 - r.x0, height = r.y1 - r.y0;
  const Extent place{x - s.step, y - s.step, x + width * s.step, y + height * s.step};
  const Extraction found = extract(db, {.error = error, .region = Region::inside(place)});
  std::vector<double> z(r.area());
  Blend(db, found.patches, {.smoothness = smoothness})
      .at_pixels({x, s.step, 0, y, 0, s.step}, width, 0, height, {z, {}, {}, {}});
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double now = z[std::size_t(j) * std::size_t(width) + std::size_t(i)];
      const float height_now = std::isfinite(now) ? float(now) : effects::Relief::kLow;
      float& at = heights_->z[std::size_t(r.y0 + j) * std::size_t(s.width) + std::size_t(r.x0 + i)];
      if (at == height_now) continue;
      at = height_now;
      heights_->changed = heights_->changed.with({r.x0 + i, r.y0 + j, r.x0 + i + 1, r.y0 + j + 1});
    }
}

void LightMap::heights_changed(std::span<const Extent> places) {
  if (!heights_) return;
  const effects::ReliefShape& s = heights_->shape;
  for (std::size_t b = 0; b < heights_->missing.size(); ++b) {
    const LightRect r = heights_->block(b);
    const Extent own{s.first.x + (r.x0 - 1) * s.step, s.first.y + (r.y0 - 1) * s.step,
                     s.first.x + r.x1 * s.step, s.first.y + r.y1 * s.step};
    for (const Extent& e : places)
      if (e.meets(own)) heights_->missing[b] = true;
  }
}

// Maps of another shape begin anew; else what the changed heights reach is stale, by the highest and lowest
// before and after.
void LightMap::use_heights() {
  const bool same_shape = relief_ && relief_->shape() == heights_->shape;
  const LightRect changed = std::exchange(heights_->changed, {});
  const double range_before = relief_ ? relief_->range() : 0;
  relief_.emplace(heights_->shape, heights_->z);
  const std::vector<float> steepest = relief_->steepest(kSquare);
  steepest_ = double(*std::max_element(steepest.begin(), steepest.end()));
  relief_buffer_ = buffer_of(device_, relief_->levels());
  relief_texels_ = texels(device_, relief_buffer_, VK_FORMAT_R32_SFLOAT);
  steepest_buffer_ = buffer_of(device_, steepest);
  steepest_texels_ = texels(device_, steepest_buffer_, VK_FORMAT_R32_SFLOAT);
  if (same_shape && !changed.empty()) {
    sun_.stale = sun_.stale.with(shadowed_by(changed));
    sky_.stale = sky_.stale.with(seeing(changed, std::max(range_before, relief_->range())));
  }
  if (same_shape) return;
  sun_.image.reset(), sky_.image.reset(), ++generation_;
  sun_.stale = whole(sun_), sky_.stale = whole(sky_);
}

// Towards the sun these samples lie, or cells beside them.
LightRect LightMap::shadowed_by(const LightRect& samples) const {
  if (!made_for_) return {};
  const double azimuth = made_for_->azimuth * kDegree;
  LightRect r{samples.x0 - 1, samples.y0 - 1, samples.x1 + 1, samples.y1 + 1};
  (std::sin(azimuth) > 0 ? r.x0 : r.x1) = std::sin(azimuth) > 0 ? 0 : relief_->width();
  (std::cos(azimuth) > 0 ? r.y0 : r.y1) = std::cos(azimuth) > 0 ? 0 : relief_->height();
  return texels_near(sun_, r);
}

// From farther away they do not rise into the lowest direction.
LightRect LightMap::seeing(const LightRect& samples, double range) const {
  if (directions_ == 0) return {};
  const double far = std::min(range / (least_sky_ * relief_->step()), 1e6);
  const int n = int(far) + 2;
  return texels_near(sky_, {samples.x0 - n, samples.y0 - n, samples.x1 + n, samples.y1 + n});
}

LightRect LightMap::whole(const Map& map) const {
  return {0, 0, (relief_->width() - 1) / map.stride + 1, (relief_->height() - 1) / map.stride + 1};
}

LightRect LightMap::texels_near(const Map& map, const LightRect& samples) const {
  const LightRect s = samples.inside(relief_->width(), relief_->height()), all = whole(map);
  return LightRect{s.x0 / map.stride, s.y0 / map.stride, s.x1 / map.stride + 1, s.y1 / map.stride + 1}.inside(
      all.x1, all.y1);
}

LightMap::Push LightMap::push_for(int stride) const {
  Push p{relief_->width(),
         relief_->height(),
         relief_->top(),
         stride,
         float(relief_->step()),
         0,
         {},
         0,
         0,
         {},
         {}};
  for (int l = 0; l <= relief_->top(); ++l) p.start[l] = std::int32_t(relief_->start(l));
  return p;
}

// Row after row of what is stale. A new map is in full light first where all of it cannot be made at once.
void LightMap::make(VkCommandBuffer c, Map& map, bool sky, Push p, std::size_t most) {
  const LightRect all = whole(map);
  const bool is_new = !map.image;
  if (is_new) {
    map.image = map_of(device_, std::uint32_t(all.x1), std::uint32_t(all.y1)), ++generation_;
    map.stale = all;
  }
  const VkDescriptorSet set = sky ? sky_set_ : shadow_set_;
  bindings_.bind(set, 0, relief_texels_), bindings_.bind(set, 1, steepest_texels_);
  bindings_.bind(set, 2, VK_NULL_HANDLE, map.image->view(), VK_IMAGE_LAYOUT_GENERAL);
  if (is_new && all.area() > most) {
    Push light = p;
    light.least = 1e30f, light.region[2] = all.x1, light.region[3] = all.y1;
    dispatch(c, sky, light);
  }
  LightRect now = map.stale;
  const std::size_t rows = std::max<std::size_t>(1, most / std::size_t(now.x1 - now.x0));
  now.y1 = int(std::min<std::size_t>(std::size_t(now.y1), std::size_t(now.y0) + rows));
  p.region[0] = now.x0, p.region[1] = now.y0, p.region[2] = now.x1, p.region[3] = now.y1;
  dispatch(c, sky, p);
  texels_made += now.area();
  ++(sky ? sky_dispatches : shadow_dispatches);
  map.stale.y0 = now.y1;
  if (map.stale.empty()) map.stale = {};
}

void LightMap::dispatch(VkCommandBuffer c, bool sky, const Push& push) {
  OwnedPipeline& pipeline = sky ? sky_pipeline_ : shadow_pipeline_;
  const std::uint32_t constants[] = {sky};
  if (!pipeline) pipeline = make_pipeline(bindings_, shaders::light(), constants);
  const VkDescriptorSet set = sky ? sky_set_ : shadow_set_;
  vkCmdBindPipeline(c, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.get());
  vkCmdBindDescriptorSets(c, VK_PIPELINE_BIND_POINT_COMPUTE, bindings_.layout(), 0, 1, &set, 0, nullptr);
  vkCmdPushConstants(c, bindings_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
  const auto groups = [](int from, int to) { return std::uint32_t(to - from + 7) / 8; };
  vkCmdDispatch(c, groups(push.region[0], push.region[2]), groups(push.region[1], push.region[3]), 1);
  barrier(c);
}

void LightMap::record(VkCommandBuffer c, const std::optional<effects::Sun>& sun,
                      const std::optional<effects::Shadow>& shadow, const std::optional<effects::Sky>& sky,
                      std::size_t rays) {
  if (shadow && (!made_for_ || !same(*made_for_, *sun) || softness_ != shadow->softness)) {
    sun_.stale = whole(sun_);
    made_for_ = sun, softness_ = shadow->softness;
  }
  if (shadow && (!sun_.image || !sun_.stale.empty())) {
    Push p = push_for(1);
    const double half = 0.5 * shadow->softness, azimuth = sun->azimuth * kDegree;
    p.to_sun[0] = float(std::sin(azimuth)), p.to_sun[1] = float(std::cos(azimuth));
    p.least = float(std::tan((sun->elevation - half) * kDegree));
    p.enough = float(std::tan(std::min(89.9, sun->elevation + half) * kDegree)) + 1e-3f;
    make(c, sun_, false, p, rays);
  }
  if (sky && directions_ != sky->directions) {
    sky_.stale = whole(sky_);
    directions_ = sky->directions, least_sky_ = effects::lowest_direction(*sky);
  }
  if (sky && (!sky_.image || !sky_.stale.empty())) {
    Push p = push_for(kSkyStride);
    p.directions = sky->directions, p.least = float(least_sky_);
    make(c, sky_, true, p, rays / std::size_t(sky->directions));
  }
}

}  // namespace patchwork::vk
