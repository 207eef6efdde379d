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

uint holes_along(int slot, int b) { return texelFetch(blocks, (slot * 64 + b) * kBlock).z >> kHolesShift; }

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
  return Mesh(uvec2(bits[0], bits[1] & kInsideHigh), bits[2] & kEdges, true, false, 0);
}

shared float room[64];  // metres that a block's error may have; below 0 where it is no part of a quad

uint quad_of(int b, int draw_block, float metres) {
  const int rep = b & ~9;
  room[b] = metres;
  barrier();
  const float least = min(min(room[rep], room[rep + 1]), min(room[rep + 8], room[rep + 9]));
  const uvec4 errors = texelFetch(blocks, draw_block + rep * kBlock + kQuadErrors);
  if (uintBitsToFloat(errors.z) > least) return 0;
  return kQuad | (uintBitsToFloat(errors.y) > least ? 0 : kFlat) | (errors.w != 0 ? kQuadFalls : 0);
}

void main() {
  const int d = int(gl_WorkGroupID.x), b = int(gl_LocalInvocationID.x);
  const Draw draw = draw_at(d);
  const int first = draw.slot * 64 * kBlock, block = first + b * kBlock;
  const uvec4 facts = texelFetch(blocks, block);
  const BlockView view = view_of(draw, b, uintBitsToFloat(facts.xy));
  Mesh mesh = Mesh(uvec2(0), 0, false, false, 0);
  float room_here = -1;
  if (view.seen) {
    const float metres = view.depth / (frame.detail.x * stretch_in(view.bottom, view.top)) - uintBitsToFloat(facts.w);
    const bool finest = !(view.depth > frame.axis.w && metres >= 0) || meets_holes(d, draw.slot, b);
    mesh = needed(block, finest ? -1 : clamp((floatBitsToInt(metres) >> kCodeShift) - (int(facts.z) >> kFlagBits), -1, 254));
    mesh.falls = (facts.z & kBlockFalls) != 0;
    if (!finest && (mesh.inside.x | mesh.inside.y | mesh.edges) == 0) room_here = metres;
  }
  mesh.quad = quad_of(b, first, room_here);
  needs[d * 64 + b] = packed(mesh);
}
