#version 450
// Segments of each block's edges: as many as the needier of the blocks that share an edge has, so that they agree.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 3) uniform usamplerBuffer factors;  // factors.comp
layout(binding = 4) writeonly buffer Edges { uint edges[]; };  // log2, four bits each: sides, inside; or kNone

const uint kOut = 256u, kSegments = 255u, kNone = 0xffffffffu;

uint need(uint draw, ivec2 b) {
  return texelFetch(factors, int(draw) * 64 + b.y * kBlocks + b.x).x & kSegments;
}

// Segments of the edge at side s of the tile, in this tile's terms.
uint border_need(uint d, int s, int along, uint own) {
  const int half_ = along / (kBlocks / 2);
  const uint other = texelFetch(draws, int(d) * kDraw + (half_ == 0 ? 7 : 8))[s];
  if (other == kAlone) return own;
  const uint number = other & kNumber;
  const int across = s ^ 1;
  if ((other & kFiner) != 0) {  // two of its blocks share this edge
    const int first = 2 * (along % (kBlocks / 2));
    return max(own, 2 * max(need(number, at_side(across, first)), need(number, at_side(across, first + 1))));
  }
  if ((other & kLarger) != 0) {  // this block and its pair share one of its edges
    const int theirs = ((other & kSecondHalf) != 0 ? kBlocks / 2 : 0) + along / 2;
    const uint pair = max(own, need(d, at_side(s, along ^ 1)));
    return max(need(number, at_side(across, theirs)), 2 * pair) / 2;
  }
  return max(own, need(number, at_side(across, along)));
}

void main() {
  const uint d = gl_WorkGroupID.x;
  const int k = int(gl_LocalInvocationID.x);
  const ivec2 b = ivec2(k % kBlocks, k / kBlocks);
  const uint self = texelFetch(factors, int(d) * 64 + k).x, own = self & kSegments;
  const uint west = b.x > 0 ? max(own, need(d, b - ivec2(1, 0))) : border_need(d, 0, b.y, own);
  const uint east = b.x < kBlocks - 1 ? max(own, need(d, b + ivec2(1, 0))) : border_need(d, 1, b.y, own);
  const uint south = b.y > 0 ? max(own, need(d, b - ivec2(0, 1))) : border_need(d, 2, b.x, own);
  const uint north = b.y < kBlocks - 1 ? max(own, need(d, b + ivec2(0, 1))) : border_need(d, 3, b.x, own);
  // The inside needs what the block needs; as published the least of its edges.
  const uint inside = frame.detail.w != 0 ? min(8u, min(min(west, east), min(south, north))) : own;
  const ivec4 sides = findMSB(ivec4(west, south, east, north));
  const uint all = uint(sides.x | sides.y << 4 | sides.z << 8 | sides.w << 12 | findMSB(int(inside)) << 16);
  edges[d * 64 + k] = (self & kOut) != 0 ? kNone : all;
}
