#version 450
// Segments of a block's edges (factor_edges.comp) become tessellation levels.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(vertices = 1) out;
layout(location = 0) in ivec2 block[];
layout(location = 0) patch out ivec2 whose;
layout(binding = 3) uniform usamplerBuffer edges;

void main() {
  const uint all = texelFetch(edges, block[0].x * 64 + block[0].y).x;
  const bool seen = all != 0xffffffffu;
  const uvec4 edge = uvec4(1) << (uvec4(all, all >> 4, all >> 8, all >> 12) & 15u);  // at u = 0, v = 0, u = 1, v = 1
  gl_TessLevelOuter[0] = seen ? float(edge.x) : 0, gl_TessLevelOuter[1] = seen ? float(edge.y) : 0;
  gl_TessLevelOuter[2] = seen ? float(edge.z) : 0, gl_TessLevelOuter[3] = seen ? float(edge.w) : 0;
  gl_TessLevelInner[0] = gl_TessLevelInner[1] = float(1u << (all >> 16 & 15u));
  whose = block[0];
}
