#version 450
// The drawn tiles as chunks: each its whole lattice of vertices, without tessellation.
#extension GL_GOOGLE_include_directive : require
#include "render/vulkan/terrain.glsl"
layout(location = 0) out vec3 local;
layout(constant_id = 0) const bool kStitched = false;  // no cracks between them

// Vertices of a border that a larger neighbour does not have are moved to the ones before them.
ivec2 stitched(int d, ivec2 vertex) {
  ivec2 at = vertex;
  for (int s = 0; s < 4; ++s) {
    const int across = s < 2 ? vertex.x : vertex.y, along = s < 2 ? vertex.y : vertex.x;
    const uint other = texelFetch(draws, d * kDraw + 7)[s];
    if (across == (s & 1) * kCells && other != kAlone && (other & kLarger) != 0) at[s < 2 ? 1 : 0] = along & ~1;
  }
  return at;
}

void main() {
  const Draw draw = draw_at(gl_InstanceIndex);
  ivec2 vertex = ivec2(gl_VertexIndex % kVertices, gl_VertexIndex / kVertices);
  int texel = draw.slot * kVertices * kVertices + gl_VertexIndex;
  if (kStitched) {
    vertex = stitched(gl_InstanceIndex, vertex);
    texel = texel_of(gl_InstanceIndex, draw.slot, 2 * vertex);
  }
  local = vec3(vec2(vertex) / float(kCells), float(draw.slot));
  gl_Position = frame.clip * vec4(position_of(draw, 2 * vertex, texelFetch(heights, texel).x), 1);
}
