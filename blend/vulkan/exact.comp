#version 450
// Single points in double, as blend/batch.cpp evaluates them: those that blend.comp left, and explicit ones.
#define real double
#define vec2_ dvec2
#define vec3_ dvec3
#define vec4_ dvec4
#define mat2_ dmat2
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "holes.glsl"
#include "sum.glsl"

layout(local_size_x = 64) in;

// blend/weight.h: kWeightFloor = 2^-60, kRimFloor = 2^-900.
const double kWeightFloor = 8.673617379884035e-19lf, kRimFloor = 1.1830521861667747e-271lf;

// Rectangles of the record in double.
vec4_ four(int at) { return vec4_(exact[at], exact[at + 1], exact[at + 2], exact[at + 3]); }

// 1 / width of the ramps between a rectangle and the kernel inside it.
vec4_ slope_of(vec4_ kernel, vec4_ ramp) {
  return vec4_(1 / (kernel.x - ramp.x), 1 / (kernel.y - ramp.y), 1 / (ramp.z - kernel.z), 1 / (ramp.w - kernel.w));
}

bool outside(vec4_ r, double u, double v, double room) {
  return u < r.x - room || u > r.z + room || v < r.y - room || v > r.w + room;
}

// Batch::add for one patch and one point, the same operations in the same order.
void compose(inout Sum s, uint entry, dvec2 at) {
  if (kPriority && s.rest == 0) return;
  const int e = int(entry) * kEntry, slot = int(texelFetch(entries, e + 2).w);
  const int x = slot * kExactRecord;
  precise const double dx = at.x - exact[x], dy = at.y - exact[x + 1];
  precise const double wu = (exact[x + 2] * dx + exact[x + 3] * dy) - exact[x + 6];
  precise const double wv = (exact[x + 4] * dx + exact[x + 5] * dy) - exact[x + 7];
  const vec4_ kernel = four(x + 8), ramp = four(x + 12), domain = four(x + 16);
  if (outside(domain, wu, wv, 0)) return;
  const Place u = Place(wu, 0), v = Place(wv, 0);
  Jet own = kPriority ? ramp_weight(rect_of(ramp), slope_of(kernel, ramp), u, v)
                      : wendland_weight(rect_of(domain), u, v);
  Jet least = own;
  if (kPriority && ramp != domain) least = ramp_weight(rect_of(domain), slope_of(kernel, domain), u, v);
  const int holes = int(texelFetch(records, slot * kRecord + 5).z);
  bool real_cell = true;
  if (holes >= 0) {
    const uint bits = cell_bits(holes, u, v);
    if ((bits & 1u) == 0) return;
    real_cell = (bits & 2u) != 0;
    own = times(own, hole_factor(holes, u, v));
  }
  const Jet faded = own;
  precise const double weight = own.at + (kWeightFloor * least.at + kRimFloor);
  own = Jet(weight, own.u + kWeightFloor * least.u, own.v + kWeightFloor * least.v);
  const Jet code = interpolate(slot, 0, u, v);
  const double quantum = exact[x + 24];
  precise const double h = quantum * (exact[x + 26] + code.at) + exact[x + 25];
  const double error = exact[x + 28 + kSmoothness];
  const int grid = int(texelFetch(entries, e + 4).w);
  add(s, own, faded, exact[x + 27], Jet(h, quantum * code.u, quantum * code.v),
      outside(four(x + 20), wu, wv, kOnEdge) ? error + exact[x + 31] : error, real_cell ? grid : -grid,
      dmat2(exact[x + 2], exact[x + 3], exact[x + 4], exact[x + 5]));
}

// Explicit points know no blocks: all patches of their group.
Sum of_tile(Tile tile, dvec2 at) {
  Sum s = nothing();
  for (uint k = 0; k < tile.count; ++k) compose(s, tile.first + k, at);
  return s;
}

// The same list as in blend.comp.
Sum of_block(Tile tile, uint block, dvec2 at) {
  Sum s = nothing();
  const uint from = tile.lists + block * (tile.count + 1), length = texelFetch(lists, int(from)).x;
  for (uint k = 0; k < length; ++k) compose(s, tile.first + texelFetch(lists, int(from + 1 + k)).x, at);
  return s;
}

void count(Sum s, double bound) {
  atomicAdd(tally.contributions, s.reads);
  atomicMax(tally.most, s.reads);
  if (s.reads > 0 && float(bound) <= push.strict_error) atomicMax(tally.bound_max, floatBitsToUint(float(bound)));
}

void put_double(uint at, double value) {
  const uvec2 bits = unpackDouble2x32(value);
  results[at] = bits.x, results[at + 1] = bits.y;
}

// Explicit points: a work group is a tile of 64. Heights and bounds are written whole.
void explicit_point(uint at) {
  const Tile tile = tiles[gl_WorkGroupID.x];
  if (gl_LocalInvocationID.x >= tile.across) return;
  const Sum s = of_tile(tile, dvec2(points[2 * at], points[2 * at + 1]));
  Answer a = Answer(0, 0, dvec2(0), 0);
  if (s.reads > 0) a = finish(s);
  const bool any = s.reads > 0 && float(a.bound) <= push.strict_error;
  put_double(2 * at, a.height);
  put_double(push.bound_at + 2 * at, a.bound);
  results[push.source_at + at] = any ? uint(a.source) : 0;
  count(s, a.bound);
}

// A point of a tile: by its place on the lattice, so that tiles that share it give it the same bits.
void tile_point(uint at) {
  const uint a_tile = push.side * push.side, t = at / a_tile, r = at % a_tile / push.side, c = at % push.side;
  const Tile tile = tiles[t];
  const double x = double(tile.c0 + tile.stride * int(c)), y = double(tile.r0 + tile.stride * int(r));
  precise const double px = push.x0 + (push.xc * x + push.xr * y), py = push.y0 + (push.yc * x + push.yr * y);
  const Sum s = of_block(tile, r / kBlock * push.blocks + c / kBlock, dvec2(px, py));
  Answer a = Answer(0, 0, dvec2(0), 0);
  if (s.reads > 0) a = finish(s);
  count(s, a.bound);
  a.height -= push.base;
  put(at, a, s.reads > 0);
}

void main() {
  const uint n = gl_GlobalInvocationID.x;
  if (push.explicit_points != 0)
    explicit_point(n);
  else if (n < tally.later_count)
    tile_point(tally.later[n]);
}
