// What a pixel's colour is by the effects' own formulas, in double: shade.glsl as C++.
#pragma once

#include "render/effects/look.h"

namespace patchwork {

namespace shade_detail {
using namespace glsl;

// The files' functions become members; what a shader binds stands before them.
struct Shader {
  Look look{};
  bool has_sun = false, has_shadow = false, has_sky = false, has_water = false, has_haze = false,
       has_disc = false, has_tints = false, has_scale = false, has_source = false, has_contours = false;
  const ColorRamp* tint = &color_ramp(RampName::land);
  const ColorRamp* overlay = &color_ramp(RampName::viridis);
  vec3 tint_color(double t) const { return effects::linear(tint->at(t)); }
  vec3 overlay_color(double t) const { return effects::linear(overlay->at(t)); }

#define float double
  // clang-format off
#include "render/effects/sun.glsl"
#include "render/effects/shadow.glsl"
#include "render/effects/sky.glsl"
#include "render/effects/haze.glsl"
#include "render/effects/solar_disc.glsl"
#include "render/effects/water.glsl"
#include "render/effects/contours.glsl"
#include "render/effects/overlays.glsl"
#include "render/effects/shade.glsl"
  // clang-format on
#undef float
};

}  // namespace shade_detail

using ShadeReference = shade_detail::Shader;

/// The reference with the effects of `on` (curvature and wireframe are not colours).
ShadeReference reference_of(const Scene& scene, const effects::LookInput& input, const effects::Set& on);

}  // namespace patchwork
