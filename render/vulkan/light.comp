#version 450
// The light map: how far terrain rises towards the sun, or which part of the sky's directions each place sees.
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = 0) const bool kSky = false;

layout(binding = 0) uniform samplerBuffer relief;    // heights, then the pyramid of largest ones (relief.h)
layout(binding = 1) uniform samplerBuffer steepest;  // of squares of kSquare cells
layout(binding = 2, rg16f) writeonly uniform image2D map;
layout(push_constant) uniform Push {
  int width, height, top, stride;  // samples; the map has every stride-th
  float step;                      // metres
  int directions;                  // of the sky
  vec2 to_sun;                     // unit
  float least, enough;             // tangents: below the one nothing changes, above the other nothing more
  int start[12];                   // of the pyramid's levels
  int region[4];                   // texels that are made: x, y from, x, y to
} push;

const int kSquare = 16;
const float kFirst = 1.5, kNoData = -9e4;  // above what Relief has where there are no heights

int width = push.width, height = push.height, top = push.top;

float height_at(int i, int j) { return texelFetch(relief, j * push.width + i).x; }
float pyramid_max(int l, int i, int j) {
  return texelFetch(relief, push.start[l] + j * (((push.width - 2) >> l) + 1) + i).x;
}

#include "render/effects/horizon.glsl"
#include "render/effects/sky.glsl"

float open_part(vec2 p, float z) {
  int open = 0;
  for (int k = 0; k < push.directions; ++k) {
    const vec3 d = sky_direction(k, push.directions);
    const float enough = d.z * push.step;
    if (horizon(p, d.xy, z, kFirst, enough) < enough) ++open;
  }
  return float(open) / float(push.directions);
}

void main() {
  const ivec2 texel = ivec2(push.region[0], push.region[1]) + ivec2(gl_GlobalInvocationID.xy);
  if (texel.x >= push.region[2] || texel.y >= push.region[3]) return;
  const ivec2 at = min(texel * push.stride, ivec2(push.width, push.height) - 1);
  const float z = height_at(at.x, at.y);
  const ivec2 square = min(at, ivec2(push.width, push.height) - 2) / kSquare;
  const float rise = texelFetch(steepest, square.y * ((push.width - 2) / kSquare + 1) + square.x).x;
  float value = kSky ? 1.0 : -1.0;
  // The tile gate: where nothing rises that far, the light is whole.
  if (z > kNoData && rise > push.least) {
    const vec2 p = vec2(at);
    value = kSky ? open_part(p, z) : clamp(horizon(p, push.to_sun, z, kFirst, push.enough * push.step) / push.step, -1.0, 1e4);
  }
  imageStore(map, texel, vec4(value, 0, 0, 0));
}
