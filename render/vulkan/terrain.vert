#version 450
// A vertex of the mesh (triangles.comp): its height comes from the tile that owns it.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(location = 0) out vec4 local;  // xy: in the tile, 0 to 1; z: the draw, kNoData without data; w: the slot

void main() {
  const int d = draw_named(uint(gl_VertexIndex));
  const ivec2 at = half_cells_named(uint(gl_VertexIndex));
  const Draw draw = draw_at(d);
  const float height = texelFetch(heights, texel_of(d, draw.slot, at)).x;
  const bool valid = !isnan(height);
  local = vec4(vec2(at) / float(2 * kCells), valid ? float(d) : kNoData, float(draw.slot));
  gl_Position = frame.clip * vec4(position_of(draw, at, valid ? height : 0), 1);
}
