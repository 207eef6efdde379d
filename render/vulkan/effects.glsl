// The effects in shaders of pixels: their switches, numbers, ramps and maps, then their own files.
layout(constant_id = 1) const bool has_sun = false;
layout(constant_id = 2) const bool has_shadow = false;
layout(constant_id = 3) const bool has_sky = false;
layout(constant_id = 4) const bool has_water = false;
layout(constant_id = 5) const bool has_haze = false;
layout(constant_id = 6) const bool has_disc = false;
layout(constant_id = 7) const bool has_tints = false;
layout(constant_id = 8) const bool has_scale = false;
layout(constant_id = 9) const bool has_source = false;
layout(constant_id = 10) const bool has_contours = false;
layout(constant_id = 11) const bool has_cost = false;   // with has_scale: patches of the tile, not bounds
layout(constant_id = 12) const bool is_wireframe = false;
// Of the whole picture, whatever matters to the tile that is drawn.
layout(constant_id = 13) const bool is_dithered = false;
layout(constant_id = 14) const bool is_plain = true;  // as the benchmark's peers draw (tools/bench/peer_slopes.frag)

#include "render/effects/look.glsl"
layout(binding = 5) uniform LookBlock { Look look; };
layout(binding = 6) uniform samplerBuffer ramps;       // linear light: kRamp tints, kRamp of the overlay, classes
layout(binding = 7) uniform sampler2D sun_map;         // tangent under which terrain rises towards the sun
layout(binding = 8) uniform sampler2D sky_map;         // part of the sky's directions that see the sky
layout(binding = 9) uniform sampler2DArray knowledge;  // of a slot's half cells: bound, source

const int kRamp = 64, kClasses = 2048;

vec3 ramp_color(int first, float t) {
  const float at = t * float(kRamp - 1);
  const int k = min(int(at), kRamp - 2);
  return mix(texelFetch(ramps, first + k).rgb, texelFetch(ramps, first + k + 1).rgb, at - float(k));
}
vec3 tint_color(float t) { return ramp_color(0, t); }
vec3 overlay_color(float t) { return ramp_color(kRamp, t); }
vec3 class_color(int source) { return texelFetch(ramps, 2 * kRamp + clamp(abs(source) - 1, 0, kClasses - 1)).rgb; }

#include "render/effects/sun.glsl"
#include "render/effects/shadow.glsl"
#include "render/effects/sky.glsl"
#include "render/effects/haze.glsl"
#include "render/effects/solar_disc.glsl"
#include "render/effects/water.glsl"
#include "render/effects/contours.glsl"
#include "render/effects/overlays.glsl"
#include "render/effects/shade.glsl"

// Of the pixel that the shader makes.
vec4 picture_color(vec3 light) {
  return vec4(srgb(light) + (is_dithered ? dither(gl_FragCoord.x, gl_FragCoord.y) : 0.0), 1);
}
