#version 450
// Where each block's edges are split: at the vertices of both blocks that share an edge, so that they agree; and how
// many triangles that makes. Of a quad its first block tells, and the one after it where all of its sides are split.
#extension GL_GOOGLE_include_directive : require
#include "mesh.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 5) uniform usamplerBuffer needs;
layout(binding = 6) writeonly buffer Edges { uvec4 edges[]; };  // sides 0 and 1, sides 2 and 3: bit p of a half word is
                                                                // half cell p, 1 to 15; triangles;
                                                                // those of the blocks before it. After a quad's
                                                                // first block: its sides, half cells 1 to 31
layout(binding = 8) writeonly buffer Counts { uint counts[]; };  // triangles of a draw

shared uint block_triangles[64], rows[kBlocks];
shared uvec2 splits[64];

// Of side s of a block: bit p, 1 to 7.
uint need(uint draw, ivec2 b, int s) {
  return texelFetch(needs, int(draw) * 64 + b.y * kBlocks + b.x).z >> (8 * s) & 0xffu;
}
bool in_quad(uint draw, ivec2 b) { return (texelFetch(needs, int(draw) * 64 + b.y * kBlocks + b.x).w & kQuad) != 0; }
// Bit p becomes bit 2 p.
uint spread(uint bits) {
  bits = (bits | bits << 4) & 0x0f0fu;
  bits = (bits | bits << 2) & 0x3333u;
  return (bits | bits << 1) & 0x5555u;
}

// What lies beyond side s of the tile adds to an edge there, in this tile's half cells.
uint border_need(uint d, int s, int along) {
  const uint other = texelFetch(draws, int(d) * kDraw + (along < kBlocks / 2 ? 7 : 8))[s];
  if (other == kAlone) return 0;
  const uint number = other & kNumber;
  const int across = s ^ 1;
  if ((other & kFiner) != 0) {  // two of its blocks share this edge
    const int first = 2 * (along % (kBlocks / 2));
    const uint between = in_quad(number, at_side(across, first)) ? 0 : 1u << 8;
    return need(number, at_side(across, first), across) | between |
           need(number, at_side(across, first + 1), across) << 8;
  }
  if ((other & kLarger) != 0) {  // this block and its pair share one of its edges
    const int theirs = ((other & kSecondHalf) != 0 ? kBlocks / 2 : 0) + along / 2;
    const uint bits = need(number, at_side(across, theirs), across);
    return spread(spread((along & 1) != 0 ? bits >> 4 : bits & 0xfu)) & 0xfffeu;
  }
  return spread(need(number, at_side(across, along), across));
}

// Is there a vertex in the middle of side s of a quad, where its blocks `along` and along + 1 meet?
bool has_middle(uint d, ivec2 b, int s, int along) {
  const ivec2 beside = b + ivec2(s == 1 ? 1 : s == 0 ? -1 : 0, s == 3 ? 1 : s == 2 ? -1 : 0);
  if (beside == clamp(beside, ivec2(0), ivec2(kBlocks - 1))) return !in_quad(d, beside);
  const uint other = texelFetch(draws, int(d) * kDraw + (along < kBlocks / 2 ? 7 : 8))[s];
  if (other == kAlone) return false;
  const uint number = other & kNumber;
  const int across = s ^ 1;
  if ((other & kFiner) != 0) return true;  // two quads of its meet there
  if ((other & kLarger) == 0) return !in_quad(number, at_side(across, along));
  const int theirs = ((other & kSecondHalf) != 0 ? kBlocks / 2 : 0) + along / 2;
  return (need(number, at_side(across, theirs), across) >> 4 & 1u) != 0;
}

// Where the sides of the quad that begins at block b are split.
uvec4 quad_splits(uint d, ivec2 b) {
  const int k = b.y * kBlocks + b.x;
  uvec4 all;
  for (int s = 0; s < 4; ++s) {
    const int first = k + (s == 1 ? 1 : s == 3 ? kBlocks : 0), second = first + (s < 2 ? kBlocks : 1);
    const int at = 16 * (s & 1);
    all[s] = splits[first][s >> 1] >> at & 0xffffu | (splits[second][s >> 1] >> at & 0xffffu) << 16;
    const ivec2 on_side = ivec2(first % kBlocks, first / kBlocks);
    all[s] |= has_middle(d, on_side, s, s < 2 ? b.y : b.x) ? 1u << 16 : 0;
  }
  return all;
}

void main() {
  const uint d = gl_WorkGroupID.x;
  const int k = int(gl_LocalInvocationID.x);
  const ivec2 b = ivec2(k % kBlocks, k / kBlocks);
  const Mesh own = unpacked(texelFetch(needs, int(d) * 64 + k));
  uint split[4];
  for (int s = 0; s < 4; ++s) {
    const ivec2 beside = b + ivec2(s == 1 ? 1 : s == 0 ? -1 : 0, s == 3 ? 1 : s == 2 ? -1 : 0);
    const bool in_tile = beside == clamp(beside, ivec2(0), ivec2(kBlocks - 1));
    split[s] = spread(own.edges >> (8 * s) & 0xffu);
    split[s] |= in_tile ? spread(need(d, beside, s ^ 1)) : border_need(d, s, s < 2 ? b.y : b.x);
  }
  uvec2 all = uvec2(split[0] | split[1] << 16, split[2] | split[3] << 16);
  splits[k] = all;
  barrier();
  // A mesh of a disc has so many triangles: two for each vertex inside, one for each on its rim, less two.
  int rim = bitCount(all.x) + bitCount(all.y), inner = bitCount(own.inside.x) + bitCount(own.inside.y);
  bool drawn = own.seen;
  uvec4 quad = uvec4(0);
  if ((own.quad & kQuad) != 0) {
    drawn = (k & 9) == 0;
    if (drawn) quad = quad_splits(d, b);
    rim = bitCount(quad.x) + bitCount(quad.y) + bitCount(quad.z) + bitCount(quad.w);
    inner = (own.quad & kFlat) != 0 ? 0 : 1;
  }
  const uint triangles = drawn ? uint(2 * max(inner, rim > 0 ? 1 : 0) + rim + 2) : 0;
  block_triangles[k] = triangles;
  barrier();
  uint row = 0;
  for (int j = 0; k < kBlocks && j < kBlocks; ++j) row += block_triangles[kBlocks * k + j];
  if (k < kBlocks) rows[k] = row;
  barrier();
  uint before = 0;
  for (int j = 0; j < b.y; ++j) before += rows[j];
  for (int j = kBlocks * b.y; j < k; ++j) before += block_triangles[j];
  const bool after_first = (own.quad & kQuad) != 0 && (k & 9) == 1;
  if (!after_first) edges[d * 64 + k] = uvec4(all, triangles, before);
  if ((own.quad & kQuad) != 0 && drawn) edges[d * 64 + k + 1] = quad;
  if (k == 63) counts[d] = before + triangles;
}
