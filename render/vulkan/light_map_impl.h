// Where the sun reaches and how much of the sky each place sees, in a raster over the terrain.
#pragma once

#include <optional>

#include "blend/vulkan/pipeline_impl.h"
#include "render/effects/relief.h"
#include "render/scene.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

/// Heights are its key; the shadow's other one is the sun. What a scene does not call for is neither made nor
/// held.
class LightMap {
 public:
  static constexpr int kSide = 1025;  ///< samples a side at most; the sky has every fourth
  explicit LightMap(const Device::Impl& device);

  /// Heights of the database's best surface at the map's step. Throws Error: damaged payloads, no memory.
  void take_heights(const Database& db, int smoothness);
  void drop_heights() { relief_.reset(); }
  bool has_heights() const { return relief_.has_value(); }
  /// REQUIRES of what follows: has_heights().
  const effects::Relief& relief() const { return *relief_; }
  double steepest() const { return steepest_; }  ///< tangent that no horizon exceeds

  /// Makes what is stale or missing.
  void record(VkCommandBuffer commands, const std::optional<effects::Sun>& sun,
              const std::optional<effects::Shadow>& shadow, const std::optional<effects::Sky>& sky);
  /// One texel where there is no such map.
  const Texture& sun_map() const { return sun_ ? *sun_ : nothing_; }
  const Texture& sky_map() const { return sky_ ? *sky_ : nothing_; }
  /// Changes whenever one of the maps is another image.
  unsigned generation() const { return generation_; }
  std::size_t shadow_dispatches = 0, sky_dispatches = 0;  ///< so far

 private:
  struct Push;
  Push push_for(int stride) const;
  Texture make_map(int stride) const;
  void dispatch(VkCommandBuffer commands, bool sky, const Texture& map, const Push& push);

  const Device::Impl& device_;
  Bindings bindings_;
  OwnedPipeline shadow_pipeline_, sky_pipeline_;  // made when first needed
  VkDescriptorSet shadow_set_ = VK_NULL_HANDLE, sky_set_ = VK_NULL_HANDLE;
  OwnedSets shadow_sets_, sky_sets_;
  std::optional<effects::Relief> relief_;
  double steepest_ = 0;
  Buffer relief_buffer_, steepest_buffer_;
  OwnedView relief_texels_, steepest_texels_;
  Texture nothing_;
  std::optional<Texture> sun_, sky_;
  std::optional<effects::Sun> made_for_;  // what the maps hold
  double softness_ = -1;
  int directions_ = 0;
  unsigned generation_ = 1;
};

}  // namespace patchwork::vk
