#version 450
// A vertex of the mesh: its height comes from the tile that owns it.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(quads, equal_spacing, ccw) in;
layout(location = 0) patch in ivec2 whose;
layout(location = 0) out vec4 local;  // xy: in the tile, 0 to 1; z: the draw, kNoData without data; w: the slot

void main() {
  const int d = whose.x;
  const Draw draw = draw_at(d);
  const ivec2 block = ivec2(whose.y % kBlocks, whose.y / kBlocks);
  const ivec2 at = block * (2 * kBlockCells) + ivec2(gl_TessCoord.xy * float(2 * kBlockCells) + 0.5);
  const float height = texelFetch(heights, texel_of(d, draw.slot, at)).x;
  const bool valid = !isnan(height);
  local = vec4(vec2(at) / float(2 * kCells), valid ? float(d) : kNoData, float(draw.slot));
  gl_Position = frame.clip * vec4(position_of(draw, at, valid ? height : 0), 1);
}
