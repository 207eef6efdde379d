#include <algorithm>
#include <cmath>
#include <cstring>

#include "render/legend.h"
#include "render/vulkan/frame_effects_impl.h"

namespace patchwork::vk {

namespace {

// effects.glsl
constexpr int kRamp = 64;
constexpr std::size_t kClasses = 2048;  // a half float holds their numbers
constexpr std::size_t kColors = 2 * kRamp + kClasses;
using effects::Id;

}  // namespace

FrameEffects::FrameEffects(const Device::Impl& device, const Database& db, const Scene& scene)
    : db_(db),
      scene_(scene),
      map_(device),
      look_(device, sizeof block_, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, Where::upload),
      ramps_(device, kColors * 16, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT, Where::upload),
      ramp_texels_(texels(device, ramps_, VK_FORMAT_R32G32B32A32_SFLOAT)) {
  put_ramps();
}

void FrameEffects::change(const Scene& scene) {
  scene_ = scene, changed_ = true, kept_.reset();
  put_ramps();
}

void FrameEffects::put_ramps() {
  const RampName tints = scene_.effects.tints ? scene_.effects.tints->ramp : RampName::land;
  std::vector<Color> colors = color_ramp(tints).table(kRamp);
  const std::vector<Color> overlay =
      color_ramp(scene_.effects.cost ? RampName::cividis : RampName::viridis).table(kRamp);
  colors.insert(colors.end(), overlay.begin(), overlay.end());
  colors.resize(kColors, class_color(kClassColors));
  for (std::size_t k = 0; k < db_.grids().size(); ++k)
    if (const std::size_t id = db_.grids()[k].info.id.value; id < kClasses)
      colors[2 * kRamp + id] = class_color(k);
  auto* to = reinterpret_cast<float*>(ramps_.mapped());
  for (const Color c : colors) {
    const glm::dvec3 l = effects::linear(c);
    for (const double v : {l.x, l.y, l.z, 1.0}) *to++ = float(v);
  }
}

// What the scene leaves open comes from the picture: the bounds of its tiles.
ValueScale FrameEffects::overlay_of(std::span<const float> bounds) const {
  if (scene_.effects.cost) return {1, scene_.effects.cost->highest, false};
  if (!scene_.effects.error) return {};
  const effects::ErrorOverlay& e = *scene_.effects.error;
  ValueScale s = scale_of(bounds);
  s.lowest = e.lowest.value_or(s.lowest), s.highest = e.highest.value_or(s.highest);
  s.logarithmic = (s.logarithmic || e.logarithmic) && s.lowest > 0;
  return s;
}

bool FrameEffects::prepare(effects::SceneView view, std::span<const float> bounds,
                           const LightBudget& budget) {
  bytes_set_ = 0;
  if (wants_map()) {
    map_.take_heights(db_, scene_.smoothness, budget.ms);
    view.steepest = map_.has_heights() ? map_.steepest() : -INFINITY;
  }
  const effects::Set before = on_;
  on_ = effects::called_for(scene_, view);
  const auto tints = scene_.effects.tints.value_or(effects::Tints{});
  tints_ = {tints.lowest.value_or(view.lowest), tints.highest.value_or(view.highest), false};
  scale_ = kept_ ? *kept_ : overlay_of(bounds);
  effects::Look look = effects::look_of(scene_, {view, tints_, scale_});
  if (map_.has_heights()) {
    const effects::Relief& r = map_.relief();
    look.light_map = {(view.camera.eye.x - r.first().x) / r.step(),
                      (view.camera.eye.y - r.first().y) / r.step(), 1 / r.step(), 0};
  }
  const auto block = effects::block_of(look);
  if (!changed_ && block == block_ && on_ == before) return light_left() > 0;
  block_ = block, changed_ = false;
  std::memcpy(look_.mapped(), block_.data(), sizeof block_);
  bytes_set_ = sizeof block_;
  return true;
}

void FrameEffects::record_maps(VkCommandBuffer commands, const LightBudget& budget) {
  const auto only = [&](const auto& effect, Id id) {
    return has(on_, id) ? effect : std::remove_cvref_t<decltype(effect)>();
  };
  map_.record(commands, scene_.effects.sun, only(scene_.effects.shadow, Id::shadow),
              only(scene_.effects.sky, Id::sky), budget.rays);
}

void FrameEffects::bind(const Bindings& bindings, VkDescriptorSet set, const TileStore& store) const {
  const auto image = [&](std::uint32_t at, const Texture& t) {
    bindings.bind(set, kFirst + at, store.sampler.get(), t.view(), VK_IMAGE_LAYOUT_GENERAL);
  };
  bindings.bind(set, kFirst, look_), bindings.bind(set, kFirst + 1, ramp_texels_);
  image(2, map_.sun_map()), image(3, map_.sky_map());
  image(4, store.knowledge ? *store.knowledge : store.slopes);
}

double FrameEffects::curvature(const effects::SceneView& view) const {
  return has(effects::called_for(scene_, view), Id::curvature) ? drop_per_square(*scene_.effects.curvature)
                                                               : 0;
}

void FrameEffects::draw_legend(Image& picture) const {
  if (!scene_.legend) return;
  std::vector<RampLegend> ramps;
  std::vector<ClassLegend> classes;
  const SceneEffects& e = scene_.effects;
  if (e.tints) ramps.push_back({"Height, m", &color_ramp(e.tints->ramp), tints_});
  if (e.error) ramps.push_back({"Bound, m", &color_ramp(RampName::viridis), scale_});
  if (e.cost) ramps.push_back({"Patches a tile", &color_ramp(RampName::cividis), scale_});
  if (e.source) {
    classes.push_back({"Grid", {}});
    const std::size_t n = db_.grids().size();
    for (std::size_t k = 0; k < std::min(n, kClassColors); ++k)
      classes[0].classes.emplace_back(class_color(k), db_.grids()[k].info.name);
    if (n > kClassColors)
      classes[0].classes.emplace_back(class_color(kClassColors),
                                      std::to_string(n - kClassColors) + " more grids");
  }
  if (!ramps.empty() || !classes.empty()) draw_legends(picture, ramps, classes);
}

std::vector<std::uint32_t> FrameEffects::constants(const effects::Set& set, bool holes,
                                                   bool wireframe) const {
  const auto is = [&](Id id) { return std::uint32_t(has(set, id)); };
  const bool smooth_colors = has(on_, Id::haze) || has(on_, Id::solar_disc) || has(on_, Id::water);
  effects::Set shading = on_;  // what changes the colour of the ground
  for (const Id id : {Id::shadow, Id::curvature, Id::solar_disc, Id::wireframe})
    shading[std::size_t(id)] = false;
  return {holes,
          is(Id::sun),
          is(Id::shadow),
          is(Id::sky),
          is(Id::water),
          is(Id::haze),
          is(Id::solar_disc),
          is(Id::tints),
          is(Id::error) | is(Id::cost),
          is(Id::source),
          is(Id::contours),
          is(Id::cost),
          wireframe,
          smooth_colors,
          shading.none() && !wireframe};
}

}  // namespace patchwork::vk
