#version 450
// Where each block's edges are split: at the vertices of both blocks that share an edge, so that they agree; and how
// many triangles that makes.
#extension GL_GOOGLE_include_directive : require
#include "mesh.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 5) uniform usamplerBuffer needs;
layout(binding = 6) writeonly buffer Edges { uvec4 edges[]; };  // sides 0 and 1, sides 2 and 3: bit p of a half word is
                                                                // half cell p, 1 to 15; triangles;
                                                                // those of the blocks before it
layout(binding = 8) writeonly buffer Counts { uint counts[]; };  // triangles of a draw

shared uint block_triangles[64], rows[kBlocks];

// Of side s of a block: bit p, 1 to 7.
uint need(uint draw, ivec2 b, int s) {
  return texelFetch(needs, int(draw) * 64 + b.y * kBlocks + b.x).z >> (8 * s) & 0xffu;
}
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
    return need(number, at_side(across, first), across) | 1u << 8 |
           need(number, at_side(across, first + 1), across) << 8;
  }
  if ((other & kLarger) != 0) {  // this block and its pair share one of its edges
    const int theirs = ((other & kSecondHalf) != 0 ? kBlocks / 2 : 0) + along / 2;
    const uint bits = need(number, at_side(across, theirs), across);
    return spread(spread((along & 1) != 0 ? bits >> 4 : bits & 0xfu)) & 0xfffeu;
  }
  return spread(need(number, at_side(across, along), across));
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
  const uvec2 all = uvec2(split[0] | split[1] << 16, split[2] | split[3] << 16);
  // A mesh of a disc has so many triangles: two for each vertex inside, one for each on its rim, less two.
  const int rim = bitCount(all.x) + bitCount(all.y), inner = bitCount(own.inside.x) + bitCount(own.inside.y);
  const uint triangles = own.seen ? uint(2 * max(inner, rim > 0 ? 1 : 0) + rim + 2) : 0;
  block_triangles[k] = triangles;
  barrier();
  uint row = 0;
  for (int j = 0; k < kBlocks && j < kBlocks; ++j) row += block_triangles[kBlocks * k + j];
  if (k < kBlocks) rows[k] = row;
  barrier();
  uint before = 0;
  for (int j = 0; j < b.y; ++j) before += rows[j];
  for (int j = kBlocks * b.y; j < k; ++j) before += block_triangles[j];
  edges[d * 64 + k] = uvec4(all, triangles, before);
  if (k == 63) counts[d] = before + triangles;
}
