#version 450
// Which vertices each block of each drawn tile needs so that its mesh keeps to the pixel error: those whose absence
// the depth of the block's nearest point does not allow (tile_finish.comp). The published choices (Yusov and
// Shevtsov, section 5), kept to show what the guarantee costs: every, every second, fourth or eighth vertex of a
// block, by its middle instead of its nearest point, and by the error of a tile's own vertices alone.
#extension GL_GOOGLE_include_directive : require
#include "mesh.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 3) uniform usamplerBuffer blocks;  // tile_finish.comp: kBlock texels a block
layout(binding = 4) writeonly buffer Needs { uvec4 needs[]; };

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

// Vertices whose code exceeds what is allowed; below 0 all of them.
Mesh needed(int block, int allowed) {
  uint bits[3] = uint[](0, 0, 0);
  for (int k = 0; k < 6; ++k) {
    const uvec4 codes = texelFetch(blocks, block + 2 + k);
    uint found = 0;
    for (int b = 0; b < 16; ++b)
      found |= (int(codes[b >> 2] >> (8 * (b & 3)) & 255u) > allowed ? 1u : 0u) << b;
    bits[k >> 1] |= found << (16 * (k & 1));
  }
  return Mesh(uvec2(bits[0], bits[1] & kInsideHigh), bits[2] & kEdges, true, false);
}

// Every vertex at multiples of 8 / segments.
Mesh uniform_mesh(uint segments) {
  if (segments == 1) return Mesh(uvec2(0), 0, true, false);
  if (segments == 2) return Mesh(uvec2(0x1000000u, 0), 0x10101010u, true, false);
  if (segments == 4) return Mesh(uvec2(0x5401500u, 0x150u), 0x54545454u, true, false);
  return Mesh(uvec2(~0u, kInsideHigh), kEdges, true, false);
}

uint published_segments(vec3 errors, float allowed) {
  return errors.z <= allowed ? 1 : errors.y <= allowed ? 2 : errors.x <= allowed ? 4 : 8;
}

void main() {
  const int d = int(gl_WorkGroupID.x), b = int(gl_LocalInvocationID.x);
  const Draw draw = draw_at(d);
  const int block = (draw.slot * 64 + b) * kBlock;
  const uvec4 facts = texelFetch(blocks, block);
  const vec2 range = uintBitsToFloat(facts.xy);
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
  Mesh mesh = Mesh(uvec2(0), 0, false, false);
  if (seen && frame.detail.w != 0) {
    // As published: one number for all of the picture, though its corners show more.
    const float nearest = dot(frame.axis.xyz, 0.5 * (bottom + top));
    const vec3 errors = uintBitsToFloat(texelFetch(blocks, block + 1).xyz);
    mesh = uniform_mesh(nearest > frame.axis.w ? published_segments(errors, nearest / frame.detail.x) : 8);
  } else if (seen) {
    const float metres = depth / (frame.detail.x * stretch_in(bottom, top)) - facts_at(d).x;
    const bool finest = !(depth > frame.axis.w && metres >= 0);
    mesh = needed(block, finest ? -1 : clamp((floatBitsToInt(metres) >> kCodeShift) - int(facts.z), -1, 254));
    mesh.falls = facts.w != 0;
  }
  needs[d * 64 + b] = packed(mesh);
}
