#version 450
// How many segments each block of 8 x 8 cells of each drawn tile needs along a side so that its mesh keeps to the
// pixel error: 1, 2, 4 or 8. With the block's errors (tile_finish.comp) and the depth of its nearest point. Bit
// kOut: the block is out of sight. The published choices (Yusov and Shevtsov, section 5), kept to show what the
// guarantee costs: the middle of a block instead of its nearest point, and the error of a tile's own
// vertices alone.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 3) uniform samplerBuffer blocks;  // two texels a block, metres: errors when every 2nd, 4th,
                                                   // 8th vertex is kept, lowest, highest, and those errors as published
                                                   // in the other three places
layout(binding = 4) writeonly buffer Factors { uint factors[]; };

const uint kOut = 256u;
const float kFar = 1e30;

// The largest of dot(n, corner).
float largest_along(vec3 n, vec3 low, vec3 high) {
  return n.x * (n.x > 0 ? high.x : low.x) + n.y * (n.y > 0 ? high.y : low.y) + n.z * (n.z > 0 ? high.z : low.z);
}

// What perspective makes of a vertical metre in the part of the picture where the box may be, for one across the
// line of sight: Frustum::stretch_in. All of the box is ahead.
float stretch_in(vec3 low, vec3 high) {
  const vec2 half_picture = vec2(length(frame.right.xyz), length(frame.up.xyz));
  vec2 least = vec2(kFar), most = vec2(-kFar);
  for (int k = 0; k < 8; ++k) {
    const vec3 p = vec3((k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y, (k & 4) != 0 ? high.z : low.z);
    const vec2 at = vec2(dot(frame.right.xyz, p), dot(frame.up.xyz, p)) / (half_picture * dot(frame.axis.xyz, p));
    least = min(least, at), most = max(most, at);
  }
  least = clamp(least, -half_picture, half_picture), most = clamp(most, -half_picture, half_picture);
  const float ahead = frame.axis.z, up = frame.up.z / half_picture.y;
  const float across = max(abs(least.x), abs(most.x)) * ahead;
  return 1.0001 * length(vec2(across, max(abs(up - least.y * ahead), abs(up - most.y * ahead))));
}

void main() {
  const int d = int(gl_WorkGroupID.x), b = int(gl_LocalInvocationID.x);
  const Draw draw = draw_at(d);
  const vec4 errors = texelFetch(blocks, (draw.slot * 64 + b) * 2);
  const vec4 range = texelFetch(blocks, (draw.slot * 64 + b) * 2 + 1);
  const ivec2 at = ivec2(b % kBlocks, b / kBlocks) * (2 * kBlockCells);
  const vec2 low = vec2(draw.first + at * draw.stride) * frame.eye.w - frame.eye.xy;
  const vec2 high = low + float(2 * kBlockCells * draw.stride) * frame.eye.w;
  const vec2 far = max(abs(low), abs(high));
  vec3 bottom = vec3(low, range.x + frame.eye.z - frame.detail.y * dot(far, far));
  vec3 top = vec3(high, range.y + frame.eye.z);
  bool seen = range.x <= range.y;
  for (int s = 0; s < 4; ++s) seen = seen && largest_along(frame.sides[s].xyz, bottom, top) >= 0;
  const float depth = -largest_along(-frame.axis.xyz, bottom, top);
  seen = seen && largest_along(frame.axis.xyz, bottom, top) > 0;
  const bool published = frame.detail.w != 0;
  const float nearest = published ? dot(frame.axis.xyz, 0.5 * (bottom + top)) : depth;
  const vec3 error = published ? vec3(errors.w, range.zw) : errors.xyz;
  uint segments = 8;
  if (nearest > frame.axis.w) {
    // As published: one number for all of the picture, though its corners show more.
    const float stretch = published ? 1.0 : stretch_in(bottom, top);
    const float allowed = nearest / (frame.detail.x * stretch) - (published ? 0.0 : facts_at(d).x);
    if (error.z <= allowed) segments = 1;
    else if (error.y <= allowed) segments = 2;
    else if (error.x <= allowed) segments = 4;
  }
  factors[d * 64 + b] = segments | (seen ? 0u : kOut);
}
