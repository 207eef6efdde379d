#version 450
// For each block of 16 x 16 points: which of its tile's patches reach it. With priority the list ends with the
// first patch that holds the block in its kernel; if that is the only one, the block is copied.
#define real float
#define vec2_ vec2
#define vec3_ vec3
#define vec4_ vec4
#define mat2_ mat2
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(local_size_x = 64) in;
layout(binding = 10) writeonly buffer Lists { uint written[]; };

// Rounding of coordinates decides nothing: what is nearer to a rim than this (window cells) is partial.
const float kRoom = 1.0 / 256;

// The range of u or v over the block's corners; `a` holds whole at the anchor, per column, per row.
vec2 range_of(vec3 whole, vec3 rest, vec4 corners) {
  const vec3 a = whole + rest;
  const vec4 at = a.x + a.y * corners.xzxz + a.z * corners.yyww;
  return vec2(min(min(at.x, at.y), min(at.z, at.w)), max(max(at.x, at.y), max(at.z, at.w)));
}

void main() {
  const uint blocks = push.blocks * push.blocks, block = gl_GlobalInvocationID.x % blocks;
  const uint t = gl_GlobalInvocationID.x / blocks;
  if (t >= tiles.length()) return;
  const Tile tile = tiles[t];
  const int c0 = int(block % push.blocks) * kBlock, r0 = int(block / push.blocks) * kBlock;
  const int c1 = min(c0 + kBlock, tile.across) - 1, r1 = min(r0 + kBlock, tile.down) - 1;
  const uint to = tile.lists + block * (tile.count + 1);
  if (c1 < c0 || r1 < r0) {
    written[to] = 0;
    return;
  }
  uint kept = 0, outs = 0;
  bool copied = false;
  for (uint k = 0; k < tile.count; ++k) {
    const int e = int(tile.first + k) * kEntry;
    const vec4 a = texelFetch(entries, e), b = texelFetch(entries, e + 1);
    const vec4 c = texelFetch(entries, e + 2), d = texelFetch(entries, e + 3);
    const vec4 corners = vec4(float(c0) - a.w, float(r0) - b.w, float(c1) - a.w, float(r1) - b.w);
    const vec2 u = range_of(a.xyz, b.xyz, corners), v = range_of(c.xyz, d.xyz, corners);
    const int record = int(c.w) * kRecord;
    const vec4 domain = texelFetch(records, record + 2), kernel = texelFetch(records, record);
    if (push.classify != 0 && (u.y < domain.x - kRoom || u.x > domain.z + kRoom || v.y < domain.y - kRoom ||
                               v.x > domain.w + kRoom)) {
      ++outs;
      continue;
    }
    written[to + 1 + kept++] = k;
    const bool solid = texelFetch(records, record + 7).y != 0;
    const bool holds = u.x > kernel.x + kRoom && u.y < kernel.z - kRoom && v.x > kernel.y + kRoom &&
                       v.y < kernel.w - kRoom;
    if (push.classify != 0 && kPriority && solid && holds) {
      copied = kept == 1;
      outs += tile.count - k - 1;
      break;
    }
  }
  written[to] = kept | (copied ? kCopied : 0u);
  atomicAdd(tally.outs, outs);
  atomicAdd(tally.insides, copied ? 1 : 0);
  atomicAdd(tally.partials, copied ? 0 : kept);
}
