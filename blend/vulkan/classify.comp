#version 450
// For each block of 8 x 8 points: which of its tile's patches reach it, and what is to be done with it. With
// priority the list ends with the first patch that holds the block in its kernel.
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

// Blocks of a work group of blend.comp.
const uint kBlocksAGroup = 4;

void list_work(int mode, uint number) {
  const uint n = atomicAdd(modes.counts[mode], 1);
  work[mode * push.tiles * push.blocks * push.blocks + n] = number;
  if (n % kBlocksAGroup == 0) atomicAdd(modes.groups[3 * mode], 1);
}

void main() {
  const uint blocks = push.blocks * push.blocks, number = gl_GlobalInvocationID.x, block = number % blocks;
  const uint t = number / blocks;
  if (t >= push.tiles) return;
  const Tile tile = tiles[t];
  const int c0 = int(block % push.blocks) * kBlock, r0 = int(block / push.blocks) * kBlock;
  const int c1 = min(c0 + kBlock, tile.across) - 1, r1 = min(r0 + kBlock, tile.down) - 1;
  const uint to = tile.lists + block * (tile.count + 1), wanted = c1 < c0 || r1 < r0 ? 0 : tile.count;
  uint kept = 0;
  bool copied = false, plain = true;
  for (uint k = 0; k < wanted; ++k) {
    const int e = int(tile.first + k) * kEntry;
    const vec4 a = texelFetch(entries, e), b = texelFetch(entries, e + 1);
    const vec4 c = texelFetch(entries, e + 2), d = texelFetch(entries, e + 3);
    const vec4 corners = vec4(float(c0) - a.w, float(r0) - b.w, float(c1) - a.w, float(r1) - b.w);
    const vec2 u = range_of(a.xyz, b.xyz, corners), v = range_of(c.xyz, d.xyz, corners);
    const int record = int(c.w) * kRecord;
    const vec4 domain = texelFetch(records, record + 2), kernel = texelFetch(records, record);
    if (push.classify != 0 && (u.y < domain.x - kRoom || u.x > domain.z + kRoom || v.y < domain.y - kRoom ||
                               v.x > domain.w + kRoom))
      continue;
    written[to + 1 + kept++] = k;
    const uint kind = uint(texelFetch(records, record + 5).w);
    plain = plain && (kind & (kWithoutHoles | kSteep)) == kWithoutHoles;
    const bool holds = u.x > kernel.x + kRoom && u.y < kernel.z - kRoom && v.x > kernel.y + kRoom &&
                       v.y < kernel.w - kRoom;
    if (push.classify != 0 && kPriority && (kind & kSolid) != 0 && holds) {
      copied = kept == 1 && (kind & kSteep) == 0;
      break;
    }
  }
  written[to] = kept;
  list_work(copied ? kCopy : plain ? kPlain : kHoles, number);
  atomicAdd(tally.outs, wanted - kept);
  atomicAdd(tally.insides, copied ? 1 : 0);
  atomicAdd(tally.partials, copied ? 0 : kept);
}
