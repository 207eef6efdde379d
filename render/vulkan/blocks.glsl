// Where a block of a drawn tile lies in the view, for the shaders that say how finely it is divided.
#include "terrain.glsl"

const float kFar = 1e30;

// Of a block of a slot: bit s for holes along its side s.
uint holes_along(int slot, int b);

// May a vertex on the block's rim be without data where the tile has some? It is the finest tile's that has it, and takes
// away all triangles that have it, as far as they reach.
bool meets_holes(int d, int slot, int b) {
  if (texelFetch(draws, d * kDraw + 9).y == 0) return false;  // nor has any tile that shares its vertices
  const ivec2 at = ivec2(b % kBlocks, b / kBlocks);
  bool any = false;
  for (int k = 0; k < 4; ++k) {
    const ivec2 corner = (at + ivec2(k & 1, k >> 1)) * (2 * kBlockCells);
    const int own = (slot * kVertices + corner.y / 2) * kVertices + corner.x / 2;
    any = any || isnan(texelFetch(heights, texel_of(d, slot, corner)).x) && !isnan(texelFetch(heights, own).x);
  }
  for (int s = 0; s < 4; ++s) {
    const int along = s < 2 ? at.y : at.x;
    if (at != at_side(s, along)) continue;
    const uint other = texelFetch(draws, d * kDraw + (along < kBlocks / 2 ? 7 : 8))[s];
    if (other == kAlone || (other & kFiner) == 0) continue;
    const int theirs = draw_at(int(other & kNumber)).slot, first = 2 * (along % (kBlocks / 2));
    for (int k = 0; k < 2; ++k) {
      const ivec2 beyond = at_side(s ^ 1, first + k);
      any = any || (holes_along(theirs, beyond.y * kBlocks + beyond.x) >> (s ^ 1) & 1u) != 0;
    }
  }
  return any;
}

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

struct BlockView {
  bool seen;         // perhaps; else it is out of sight
  vec3 bottom, top;  // corners of its box
  float depth;       // of the box's nearest point
};

// `range`: its lowest and highest point, metres over the base; nothing answers there if they are in no order.
BlockView view_of(Draw draw, int b, vec2 range) {
  const ivec2 at = ivec2(b % kBlocks, b / kBlocks) * (2 * kBlockCells);
  const vec2 low = vec2(draw.first + at * draw.stride) * frame.eye.w - frame.eye.xy;
  const vec2 high = low + float(2 * kBlockCells * draw.stride) * frame.eye.w;
  const vec2 far = max(abs(low), abs(high));
  BlockView v;
  v.bottom = vec3(low, range.x + frame.eye.z - frame.detail.y * dot(far, far));
  v.top = vec3(high, range.y + frame.eye.z);
  v.seen = range.x <= range.y;
  for (int s = 0; s < 4; ++s) v.seen = v.seen && largest_along(frame.sides[s].xyz, v.bottom, v.top) >= 0;
  v.depth = -largest_along(-frame.axis.xyz, v.bottom, v.top);
  v.seen = v.seen && largest_along(frame.axis.xyz, v.bottom, v.top) > 0;
  return v;
}
