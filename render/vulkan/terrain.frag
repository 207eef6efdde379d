#version 450
// A pixel of the terrain.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(location = 0) in vec3 place;
layout(location = 1) in vec3 local;
layout(location = 2) flat in ivec2 tile;
layout(location = 0) out vec4 color;
layout(binding = 4) uniform sampler2DArray slopes;  // dh/dx, dh/dy at half cells

layout(constant_id = 0) const bool kHoles = false;

vec3 normal_here() {
  const vec2 uv = (local.xy * 128.0 + 0.5) / 129.0;
  const vec2 slope = texture(slopes, vec3(uv, float(tile.x))).xy;
  return normalize(vec3(-slope, 1));
}

void main() {
  if (kHoles && local.z < 0.999) discard;
  const vec3 n = normal_here();
  const float light = 0.2 + 0.1 * dot(n, normalize(-place)) + 0.7 * max(dot(n, normalize(vec3(-0.5, 0.5, 0.7))), 0.0);
  color = vec4(vec3(0.78, 0.76, 0.7) * light, 1);
}
