// The effects of a frame on the card: which are on, their numbers, ramps and maps.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "render/effects/look.h"
#include "render/vulkan/light_map_impl.h"
#include "render/vulkan/tile_store_impl.h"

namespace patchwork::vk {

class FrameEffects {
 public:
  /// `scene`: effects, background, smoothness. REQUIRES: `db` outlives it.
  FrameEffects(const Device::Impl& device, const Database& db, const Scene& scene);

  /// What the pictures from now on call for.
  void change(const Scene& scene);
  /// Heights changed there, metres: what rests on them is made anew.
  void heights_changed(std::span<const Extent> places) {
    map_.heights_changed(places), put_ramps(), changed_ = true;
  }

  /// Of the next picture: `bounds` of its tiles, metres. Throws Error: what LightMap throws.
  /// Returns false if all is as it was for the picture before, and complete.
  bool prepare(effects::SceneView view, std::span<const float> bounds, const LightBudget& budget);
  /// Samples and texels of light that are still to come.
  std::size_t light_left() const {
    if (db_.grids().empty()) return 0;
    return map_.left(has(on_, effects::Id::shadow), has(on_, effects::Id::sky));
  }
  std::size_t light_texels() const { return map_.texels_made; }
  const effects::Set& on() const { return on_; }
  /// Metres that the ground sinks a square metre of distance.
  double curvature(const effects::SceneView& view) const;
  /// Of the error or cost overlay in the last picture; kept, it is that of all pictures until the next
  /// change.
  const ValueScale& scale() const { return scale_; }
  void keep_scale() { kept_ = scale_; }
  /// What the picture's colours stand for, where the scene wants it.
  void draw_legend(Image& picture) const;
  std::size_t bytes_set() const { return bytes_set_; }  ///< by the last prepare
  std::size_t shadow_dispatches() const { return map_.shadow_dispatches; }
  std::size_t sky_dispatches() const { return map_.sky_dispatches; }

  /// Outside of a render pass, before anything is bound: makes stale maps.
  void record_maps(VkCommandBuffer commands, const LightBudget& budget);

  /// What effects.glsl binds, from binding kFirst on; changes with the generation.
  static constexpr std::uint32_t kFirst = 5;
  static constexpr std::array<VkDescriptorType, 5> kTypes = {
      VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
      VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
      VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER};
  void bind(const Bindings& bindings, VkDescriptorSet set, const TileStore& store) const;
  unsigned generation() const { return map_.generation(); }
  /// Specialization constants of effects.glsl behind `holes`, for what needs `set` of this picture's effects.
  std::vector<std::uint32_t> constants(const effects::Set& set, bool holes, bool wireframe) const;
  /// What of this picture a tile needs.
  effects::Set matter_to(const effects::TileView& tile) const {
    return (on_ & ~kGated) | (effects::matter_to(scene_, on_, tile) & kGated);
  }
  bool gates_tiles() const { return (on_ & kGated).any(); }  ///< else all tiles need the same
  /// The sky is more than the background.
  bool draws_sky() const { return has(on_, effects::Id::haze) || has(on_, effects::Id::solar_disc); }

 private:
  // Those whose gate at a tile is worth a pipeline of its own; horizons are gated in the map (light.comp).
  static constexpr effects::Set kGated =
      effects::Set(1u << unsigned(effects::Id::water) | 1u << unsigned(effects::Id::haze) |
                   1u << unsigned(effects::Id::contours) | 1u << unsigned(effects::Id::solar_disc));

  void put_ramps();
  bool wants_map() const { return scene_.effects.shadow || scene_.effects.sky; }
  ValueScale overlay_of(std::span<const float> bounds) const;

  const Database& db_;
  Scene scene_;
  LightMap map_;
  effects::Set on_;
  ValueScale tints_, scale_;
  std::optional<ValueScale> kept_;
  std::array<float, effects::kLookFloats> block_{};
  Buffer look_, ramps_;
  OwnedView ramp_texels_;
  std::size_t bytes_set_ = 0;
  bool changed_ = true;
};

}  // namespace patchwork::vk
