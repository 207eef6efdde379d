#version 450
// Segments of a block's edges: as many as the needier of the blocks that share an edge has, so that they agree.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"

layout(vertices = 1) out;
layout(location = 0) in ivec2 block[];
layout(location = 0) patch out ivec2 whose;
layout(binding = 3) uniform usamplerBuffer factors;

const uint kOut = 256u, kSegments = 255u;

uint need(uint draw, ivec2 b) {
  return texelFetch(factors, int(draw) * 64 + b.y * kBlocks + b.x).x & kSegments;
}
// Blocks along a side, by their number from its beginning.
ivec2 at_side(int s, int along) {
  const int end = (s & 1) * (kBlocks - 1);
  return s < 2 ? ivec2(end, along) : ivec2(along, end);
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
  const uint d = uint(block[0].x);
  const ivec2 b = ivec2(block[0].y % kBlocks, block[0].y / kBlocks);
  const uint self = texelFetch(factors, int(d) * 64 + block[0].y).x, own = self & kSegments;
  uint edge[4];
  edge[0] = b.x > 0 ? max(own, need(d, b - ivec2(1, 0))) : border_need(d, 0, b.y, own);
  edge[1] = b.x < kBlocks - 1 ? max(own, need(d, b + ivec2(1, 0))) : border_need(d, 1, b.y, own);
  edge[2] = b.y > 0 ? max(own, need(d, b - ivec2(0, 1))) : border_need(d, 2, b.x, own);
  edge[3] = b.y < kBlocks - 1 ? max(own, need(d, b + ivec2(0, 1))) : border_need(d, 3, b.x, own);
  const uint most = max(max(edge[0], edge[1]), max(edge[2], edge[3]));
  const uint least = min(min(edge[0], edge[1]), min(edge[2], edge[3]));
  const uint inner = min(8u, frame.detail.w != 0 ? least : most);
  const bool out_of_sight = (self & kOut) != 0;
  gl_TessLevelOuter[0] = out_of_sight ? 0.0 : float(edge[0]);
  gl_TessLevelOuter[1] = out_of_sight ? 0.0 : float(edge[2]);
  gl_TessLevelOuter[2] = out_of_sight ? 0.0 : float(edge[1]);
  gl_TessLevelOuter[3] = out_of_sight ? 0.0 : float(edge[3]);
  gl_TessLevelInner[0] = gl_TessLevelInner[1] = float(inner);
  whose = block[0];
}
