#version 450
// Blocks of 16 x 16 points of tiles, in float32: copied from one patch or composed of several. Points where
// rounding could decide (at the rim of all data, in cells without data) are left for exact.comp.
#define real float
#define vec2_ vec2
#define vec3_ vec3
#define vec4_ vec4
#define mat2_ mat2
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#include "common.glsl"
#include "holes.glsl"
#include "sum.glsl"

// Four rows an invocation: what is loaded of a patch is used four times.
layout(local_size_x = 16, local_size_y = 4) in;

// Below this sum of weights the ramps' own rounding would show.
const float kUncertain = 1.0 / 1024;
// So near to a domain (window cells) a point that is outside may be inside.
const float kRoom = 1.0 / 65536;

struct Patch {
  vec4 whole_u, rest_u, whole_v, rest_v;  // tile_binning.h: TileEntry
  int slot, holes;
  Rect ramp, domain, samples;
  vec4 slope;
  float quantum, origin, volume, rim, error;
  int grid;
  mat2 turn;
};

// What copying needs; the rest of a patch is loaded where it is one of several.
Patch load_affine(uint entry) {
  Patch p;
  const int e = int(entry) * kEntry;
  p.whole_u = texelFetch(entries, e), p.rest_u = texelFetch(entries, e + 1);
  p.whole_v = texelFetch(entries, e + 2), p.rest_v = texelFetch(entries, e + 3);
  p.slot = int(p.whole_v.w);
  const int r = p.slot * kRecord;
  const vec4 numbers = texelFetch(records, r + 5), errors = texelFetch(records, r + 6);
  p.quantum = numbers.x, p.origin = numbers.y, p.volume = numbers.z, p.rim = numbers.w;
  p.error = errors[kSmoothness], p.holes = int(errors.w);
  p.grid = int(texelFetch(records, r + 7).x);
  const vec4 turn = kGradient ? texelFetch(records, r + 8) : vec4(0);
  p.turn = mat2(turn.x, turn.y, turn.z, turn.w);
  return p;
}

void load_rects(inout Patch p) {
  const int r = p.slot * kRecord;
  p.ramp = rect_of(texelFetch(records, r + 1)), p.domain = rect_of(texelFetch(records, r + 2));
  p.samples = rect_of(texelFetch(records, r + 3)), p.slope = texelFetch(records, r + 4);
}

Place along(vec4 whole, vec4 rest, vec2 d) {
  precise const float w = whole.x + whole.y * d.x + whole.z * d.y;
  precise const float r = rest.x + rest.y * d.x + rest.z * d.y;
  return Place(w, r);
}

Jet height_of(Patch p, Place u, Place v) {
  const Jet code = interpolate(p.slot, p.origin, u, v);
  precise const float h = p.quantum * code.at + p.rest_v.w;
  return Jet(h, p.quantum * code.u, p.quantum * code.v);
}

struct Point { Sum sum; vec2 at; bool wanted, uncertain; };

Point point_at(uint block_c, uint block_r, uint row, Tile tile) {
  const uint c = block_c * kBlock + gl_LocalInvocationID.x, r = block_r * kBlock + row + gl_LocalInvocationID.y;
  return Point(nothing(), vec2(c, r), c < tile.across && r < tile.down, false);
}

void compose(inout Point q, Patch p) {
  if (!q.wanted || (kPriority && q.sum.rest == 0)) return;
  const vec2 d = q.at - vec2(p.whole_u.w, p.rest_u.w);
  const Place u = along(p.whole_u, p.rest_u, d), v = along(p.whole_v, p.rest_v, d);
  const float depth = depth_in(p.domain, u, v);
  if (depth < -kRoom) return;
  q.uncertain = true;
  if (depth < 0) return;
  Jet own = kPriority ? ramp_weight(p.ramp, p.slope, u, v) : wendland_weight(p.domain, u, v);
  bool real_cell = true;
  if (p.holes >= 0) {
    const uint bits = cell_bits(p.holes, u, v);
    if ((bits & 1u) == 0) return;
    real_cell = (bits & 2u) != 0;
    own = times(own, hole_factor(p.holes, u, v));
  }
  const float error = depth_in(p.samples, u, v) < -kOnEdge ? p.error + p.rim : p.error;
  add(q.sum, own, own, p.volume, height_of(p, u, v), error, real_cell ? p.grid : -p.grid, p.turn);
}

uint place_of(Point q, uint tile) {
  return (tile * push.side + uint(q.at.y)) * push.side + uint(q.at.x);
}

bool on_exact_rim(Point q, Tile tile) {
  return push.exact_rim != 0 && (q.at.x == 0 || q.at.y == 0 || int(q.at.x) == tile.across - 1 ||
                                 int(q.at.y) == tile.down - 1);
}

// Vertices that nobody asked for, in tiles at the end of a raster.
void blank(Point q, uint t) {
  if (q.at.x < push.side && q.at.y < push.side) put(place_of(q, t), Answer(0, 0, vec2(0), 0), false);
}

void postpone(uint at) {
  const uint n = atomicAdd(tally.later_count, 1);
  tally.later[n] = at;
  if (n % 64 == 0) atomicAdd(tally.groups, 1);
}

// Counts the patches read where it answers.
void copy(Point q, Patch p, uint t, Tile tile, inout uint reads) {
  if (!q.wanted) {
    blank(q, t);
    return;
  }
  const uint at = place_of(q, t);
  if (on_exact_rim(q, tile)) {
    postpone(at);
    return;
  }
  const vec2 d = q.at - vec2(p.whole_u.w, p.rest_u.w);
  const Jet h = height_of(p, along(p.whole_u, p.rest_u, d), along(p.whole_v, p.rest_v, d));
  put(at, Answer(h.at, p.error, p.turn * vec2(h.u, h.v), p.grid), true);
  ++reads;
}

// Returns what the tally counts: patches read, and the bound.
void write(Point q, uint t, Tile tile, inout uint reads, inout uint most, inout float bound) {
  if (!q.wanted) {
    blank(q, t);
    return;
  }
  const uint at = place_of(q, t);
  if ((q.uncertain && !(q.sum.plain >= kUncertain)) || on_exact_rim(q, tile)) {
    postpone(at);
    return;
  }
  Answer a = Answer(0, 0, vec2(0), 0);
  if (q.sum.reads > 0) a = finish(q.sum);
  put(at, a, q.sum.reads > 0);
  reads += q.sum.reads, most = max(most, q.sum.reads);
  if (q.sum.reads > 0 && a.bound <= push.strict_error) bound = max(bound, a.bound);
}

void count(uint reads, uint most, float bound) {
  const uint all = subgroupAdd(reads), largest = subgroupMax(most), worst = subgroupMax(floatBitsToUint(bound));
  if (!subgroupElect()) return;
  atomicAdd(tally.contributions, all);
  atomicMax(tally.most, largest);
  atomicMax(tally.bound_max, worst);
}

void main() {
  const uint t = gl_WorkGroupID.z, bc = gl_WorkGroupID.x, br = gl_WorkGroupID.y;
  const Tile tile = tiles[t];
  const uint from = tile.lists + (br * push.blocks + bc) * (tile.count + 1);
  const uint length = texelFetch(lists, int(from)).x;
  Point a = point_at(bc, br, 0, tile), b = point_at(bc, br, 4, tile);
  Point c = point_at(bc, br, 8, tile), d = point_at(bc, br, 12, tile);
  uint reads = 0, most = 0;
  float bound = 0;
  if ((length & kCopied) != 0) {
    const Patch p = load_affine(tile.first + texelFetch(lists, int(from + 1)).x);
    copy(a, p, t, tile, reads), copy(b, p, t, tile, reads);
    copy(c, p, t, tile, reads), copy(d, p, t, tile, reads);
    most = min(reads, 1);
    bound = reads > 0 && p.error <= push.strict_error ? p.error : 0;
  } else {
    for (uint k = 0; k < length; ++k) {
      Patch p = load_affine(tile.first + texelFetch(lists, int(from + 1 + k)).x);
      load_rects(p);
      compose(a, p), compose(b, p), compose(c, p), compose(d, p);
    }
    write(a, t, tile, reads, most, bound), write(b, t, tile, reads, most, bound);
    write(c, t, tile, reads, most, bound), write(d, t, tile, reads, most, bound);
  }
  count(reads, most, bound);
}
