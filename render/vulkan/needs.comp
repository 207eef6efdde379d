#version 450
// Which vertices each block of each drawn tile needs so that its mesh keeps to the pixel error: those whose absence
// the depth of the block's nearest point does not allow (mesh_finish.comp).
#extension GL_GOOGLE_include_directive : require
#include "mesh.glsl"
#include "mesh_codes.glsl"
#include "blocks.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 3) uniform usamplerBuffer blocks;  // mesh_codes.glsl
layout(binding = 4) writeonly buffer Needs { uvec4 needs[]; };

// Vertices whose code exceeds what is allowed; below 0 all of them.
Mesh needed(int block, int allowed) {
  uint bits[3] = uint[](0, 0, 0);
  for (int k = 0; k < 6; ++k) {
    const uvec4 codes = texelFetch(blocks, block + 1 + k);
    uint found = 0;
    for (int b = 0; b < 16; ++b)
      found |= (int(codes[b >> 2] >> (8 * (b & 3)) & 255u) > allowed ? 1u : 0u) << b;
    bits[k >> 1] |= found << (16 * (k & 1));
  }
  return Mesh(uvec2(bits[0], bits[1] & kInsideHigh), bits[2] & kEdges, true, false);
}

void main() {
  const int d = int(gl_WorkGroupID.x), b = int(gl_LocalInvocationID.x);
  const Draw draw = draw_at(d);
  const int block = (draw.slot * 64 + b) * kBlock;
  const uvec4 facts = texelFetch(blocks, block);
  const BlockView view = view_of(draw, b, uintBitsToFloat(facts.xy));
  Mesh mesh = Mesh(uvec2(0), 0, false, false);
  if (view.seen) {
    const float metres = view.depth / (frame.detail.x * stretch_in(view.bottom, view.top)) - uintBitsToFloat(facts.w);
    const bool finest = !(view.depth > frame.axis.w && metres >= 0);
    mesh = needed(block, finest ? -1 : clamp((floatBitsToInt(metres) >> kCodeShift) - (int(facts.z) >> 1), -1, 254));
    mesh.falls = (facts.z & 1u) != 0;
  }
  needs[d * 64 + b] = packed(mesh);
}
