// Where the sun reaches and how much of the sky each place sees, in a raster over the terrain.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "blend/vulkan/pipeline_impl.h"
#include "render/effects/relief.h"
#include "render/scene.h"
#include "render/vulkan/texture_impl.h"

namespace patchwork::vk {

/// What a frame may spend on it: the rest is left to the frames that follow.
struct LightBudget {
  double ms = INFINITY;         ///< taking heights, but a block at least
  std::size_t rays = SIZE_MAX;  ///< of shadow and sky each, but a row at least
};

/// Rows and columns [x0, x1) x [y0, y1).
struct LightRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
  std::size_t area() const { return empty() ? 0 : std::size_t(x1 - x0) * std::size_t(y1 - y0); }
  LightRect with(const LightRect& o) const;  ///< the smallest that holds both
  LightRect inside(int width, int height) const;
};

/// Heights are its key; the shadow's other one is the sun. What a scene does not call for is neither made nor
/// held. Until something is made anew it stays what it was; what never was made is in full light.
class LightMap {
 public:
  static constexpr int kSide = 1025;  ///< samples a side at most; the sky has every fourth
  explicit LightMap(const Device::Impl& device);

  /// Takes what is missing of the heights of the database's best surface at the map's step; when all are
  /// there the maps rest on them. Throws Error: damaged payloads, no memory.
  void take_heights(const Database& db, int smoothness, double ms);
  /// They changed there, metres.
  void heights_changed(std::span<const Extent> places);
  bool has_heights() const { return relief_.has_value(); }
  /// REQUIRES of what follows: has_heights().
  const effects::Relief& relief() const { return *relief_; }
  double steepest() const { return steepest_; }  ///< tangent that no horizon exceeds

  /// Makes what is stale or missing, as far as `rays` go.
  void record(VkCommandBuffer commands, const std::optional<effects::Sun>& sun,
              const std::optional<effects::Shadow>& shadow, const std::optional<effects::Sky>& sky,
              std::size_t rays);
  /// Samples of heights and texels of maps that are known to be stale or missing.
  std::size_t left(bool shadow, bool sky) const {
    return samples_left() + (shadow ? sun_.stale.area() : 0) + (sky ? sky_.stale.area() : 0);
  }
  std::size_t texels_made = 0;  ///< so far
  /// One texel where there is no such map.
  const Texture& sun_map() const { return sun_.image ? *sun_.image : nothing_; }
  const Texture& sky_map() const { return sky_.image ? *sky_.image : nothing_; }
  /// Changes whenever one of the maps is another image.
  unsigned generation() const { return generation_; }
  std::size_t shadow_dispatches = 0, sky_dispatches = 0;  ///< so far

 private:
  struct Push;
  struct Map {
    int stride;
    std::optional<Texture> image = {};
    LightRect stale = {};  // texels
  };
  // The raster that heights are taken into, in blocks.
  struct Heights {
    effects::ReliefShape shape;
    std::vector<float> z;
    std::vector<bool> missing;  // of blocks, row-major
    LightRect changed;          // samples, since the relief was made of them
    int across() const;         // blocks
    LightRect block(std::size_t b) const;
  };
  std::size_t samples_left() const;
  void take_block(const Database& db, int smoothness, double error, std::size_t b);
  void use_heights();
  LightRect whole(const Map& map) const;
  LightRect texels_near(const Map& map, const LightRect& samples) const;
  LightRect shadowed_by(const LightRect& samples) const;
  LightRect seeing(const LightRect& samples, double range) const;  // range: of heights, metres
  Push push_for(int stride) const;
  void make(VkCommandBuffer commands, Map& map, bool sky, Push push, std::size_t texels);
  void dispatch(VkCommandBuffer commands, bool sky, const Push& push);

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
  std::optional<Heights> heights_;
  Map sun_, sky_;
  double least_sky_ = 0;                  // tangent: what rises less takes no light from the sky
  std::optional<effects::Sun> made_for_;  // what the maps hold
  double softness_ = -1;
  int directions_ = 0;
  unsigned generation_ = 1;
};

}  // namespace patchwork::vk
