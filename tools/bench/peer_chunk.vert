#version 450
// The drawn tiles as chunks: each its whole lattice of vertices, without tessellation.
#extension GL_GOOGLE_include_directive : require
#include "render/vulkan/terrain.glsl"
layout(location = 0) out vec3 local;

void main() {
  const Draw draw = draw_at(gl_InstanceIndex);
  const ivec2 vertex = ivec2(gl_VertexIndex % kVertices, gl_VertexIndex / kVertices);
  const float height = texelFetch(heights, draw.slot * kVertices * kVertices + gl_VertexIndex).x;
  local = vec3(vec2(vertex) / float(kCells), float(draw.slot));
  gl_Position = frame.clip * vec4(position_of(draw, 2 * vertex, height), 1);
}
