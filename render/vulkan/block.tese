#version 450
// A vertex of a tessellated block.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(quads, equal_spacing, cw) in;  // in the picture, where y points down, counterclockwise from above
layout(location = 0) patch in ivec2 whose;
layout(location = 0) out vec4 local;

void main() {
  const ivec2 block = ivec2(whose.y % kBlocks, whose.y / kBlocks);
  const Vertex v = vertex_at(whose.x, block * (2 * kBlockCells) + ivec2(gl_TessCoord.xy * float(2 * kBlockCells) + 0.5));
  local = v.local, gl_Position = v.place;
}
