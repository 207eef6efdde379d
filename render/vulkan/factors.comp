#version 450
// How many segments each block of 8 x 8 cells of each drawn tile needs along a side so that its mesh keeps to the
// pixel error: 1, 2, 4 or 8. With the block's errors (tile_finish.comp) and the depth of its nearest point. Bit
// kOut: the block is out of sight. The published choices (Yusov and Shevtsov, section 5), kept to show what the
// guarantee costs: the middle of a block instead of its nearest point, and the error of a tile's own
// vertices alone.
#extension GL_GOOGLE_include_directive : require
#include "blocks.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 3) uniform usamplerBuffer blocks;  // two texels a block, floats, metres: errors when every 2nd, 4th,
                                                   // 8th vertex is kept, lowest, highest; in the other three places those
                                                   // errors as published, or what its patches lack,
                                                   // and holes_along
layout(binding = 4) writeonly buffer Factors { uint factors[]; };

const uint kOut = 256u;

uint holes_along(int slot, int b) { return texelFetch(blocks, (slot * 64 + b) * 2 + 1).z; }

void main() {
  const int d = int(gl_WorkGroupID.x), b = int(gl_LocalInvocationID.x);
  const Draw draw = draw_at(d);
  const vec4 errors = uintBitsToFloat(texelFetch(blocks, (draw.slot * 64 + b) * 2));
  const vec4 range = uintBitsToFloat(texelFetch(blocks, (draw.slot * 64 + b) * 2 + 1));
  const BlockView view = view_of(draw, b, range.xy);
  const bool published = frame.detail.w != 0;
  const float nearest = published ? dot(frame.axis.xyz, 0.5 * (view.bottom + view.top)) : view.depth;
  const vec3 error = published ? vec3(errors.w, range.zw) : errors.xyz;
  uint segments = 8;
  if (nearest > frame.axis.w && (published || !meets_holes(d, draw.slot, b))) {
    // As published: one number for all of the picture, though its corners show more.
    const float stretch = published ? 1.0 : stretch_in(view.bottom, view.top);
    const float allowed = nearest / (frame.detail.x * stretch) - (published ? 0.0 : errors.w);
    if (error.z <= allowed) segments = 1;
    else if (error.y <= allowed) segments = 2;
    else if (error.x <= allowed) segments = 4;
  }
  factors[d * 64 + b] = segments | (view.seen ? 0u : kOut);
}
