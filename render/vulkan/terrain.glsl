// What the shaders of the terrain share: the frame, the drawn tiles, and where a vertex lies. Positions are
// metres relative to the eye.
#ifndef TERRAIN_GLSL
#define TERRAIN_GLSL

layout(binding = 0) uniform FrameBlock {
  mat4 clip;       // of positions relative to the eye
  vec4 sides[4];   // inward normals of the picture's sides; all planes go through the eye
  vec4 axis;       // of the view; w: where the near plane is
  vec4 right, up;  // of the view, to the picture's edges at depth 1; w: 2 / width, 2 / height, pixels
  vec4 eye;        // xy: what the eye's place is past its half cell; z: base of the heights - the eye's; w: half cell
  vec4 detail;     // x: gamma / pixel error: metres of depth for a metre of error across the line of sight;
                   // y: curvature, 1/metre; w: 1 for the published choices (factors.comp)
} frame;
layout(binding = 1) uniform usamplerBuffer draws;  // TileDraw of tile_seams.h, kDraw texels each
layout(binding = 2) uniform samplerBuffer heights; // metres over the base; kVertices^2 a slot

const int kCells = 64, kVertices = 65, kBlockCells = 8, kBlocks = 8, kDraw = 10;
const uint kAlone = 0xffffffffu, kLarger = 0x80000000u, kSecondHalf = 0x40000000u, kFiner = 0x20000000u;
const uint kNumber = 0x1fffffffu;
const float kNoData = -1e7;  // instead of a draw's number: negative all over a triangle with such a vertex

struct Draw { ivec2 first; int stride, slot; };
Draw draw_at(int d) {
  const uvec4 t = texelFetch(draws, d * kDraw);
  return Draw(ivec2(t.xy), int(t.z), int(t.w));
}
// Blocks along side s of a tile, by their number from its beginning.
ivec2 at_side(int s, int along) {
  const int end = (s & 1) * (kBlocks - 1);
  return s < 2 ? ivec2(end, along) : ivec2(along, end);
}
// How many patches the tile of a draw was made of.
float patches_of(int d) { return uintBitsToFloat(texelFetch(draws, d * kDraw + 9).x); }

// The texel of the vertex at half cells `at` of a tile; inside the tile both are even. One way for all: lavapipe
// runs both sides of every branch.
int texel_of(int d, int slot, ivec2 at) {
  const int last = 2 * kCells;
  const bool low_x = at.x == 0, high_x = at.x == last, low_y = at.y == 0, high_y = at.y == last;
  const int s = low_x ? 0 : high_x ? 1 : low_y ? 2 : 3, t = s < 2 ? at.y : at.x;
  const bool corner = (low_x || high_x) && (low_y || high_y);
  // The side's record, but for corners and middles the record of all four of these.
  const int record = corner ? 5 : t == kCells ? 6 : 1 + s;
  const uvec4 found = texelFetch(draws, d * kDraw + record);
  const int later = t > kCells ? 1 : 0, past = t - later * kCells;
  const bool fine = (found.w >> later & 1u) != 0;
  const int on_side = int(later == 1 ? found.y : found.x) + (fine ? past : past / 2) * int(found.z);
  const int which = corner ? (high_x ? 1 : 0) + (high_y ? 2 : 0) : s;
  const int border = record >= 5 ? int(found[which]) : on_side;
  const int inside = (slot * kVertices + at.y / 2) * kVertices + at.x / 2;
  return low_x || high_x || low_y || high_y ? border : inside;
}

// The same bits for every tile that has the vertex: whole half cells, then one rounding.
vec3 position_of(Draw draw, ivec2 at, float height) {
  const vec2 p = vec2(draw.first + at * draw.stride) * frame.eye.w - frame.eye.xy;
  return vec3(p, height + frame.eye.z - frame.detail.y * dot(p, p));
}

// For the last stage before triangles are set up: clip coordinates, and what the fragments are told.
struct Vertex {
  vec4 place;
  vec4 local;  // xyw: in images of half cells, w the slot; z: the draw, kNoData without data
};
// At half cells `at` of a draw: its height comes from the tile that owns it.
Vertex vertex_at(int d, ivec2 at) {
  const Draw draw = draw_at(d);
  const float height = texelFetch(heights, texel_of(d, draw.slot, at)).x;
  const bool valid = !isnan(height);
  return Vertex(frame.clip * vec4(position_of(draw, at, valid ? height : 0), 1),
                vec4((vec2(at) + 0.5) / float(2 * kCells + 1), valid ? float(d) : kNoData, float(draw.slot)));
}

// In a fragment shader: metres from the eye. Cheaper than a varying: lavapipe sets each up for each triangle.
vec3 place_at(vec4 pixel) {
  const float x = pixel.x * frame.right.w - 1, y = 1 - pixel.y * frame.up.w;
  return (frame.axis.xyz + x * frame.right.xyz + y * frame.up.xyz) / pixel.w;
}

#endif
