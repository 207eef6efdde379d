#version 450
// Blocks of 8 x 8 points of tiles, in float32: copied from one patch or composed of several, by kMode. Points
// where rounding could decide (at the rim of all data, in cells without data) are left for exact.comp.
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

// Four blocks, 8 x 2 invocations each; every invocation has four rows: what it loads of a patch is used four
// times.
layout(local_size_x = 64) in;

// Below this sum of weights the ramps' own rounding would show: at smoothness 0, 1, 2 a ramp has it 1/1024,
// 1/1800 and 1/550 of its width from the rim.
const float kUncertain = kSmoothness == 0 ? 1.0 / 1024 : kSmoothness == 1 ? 1.0 / 1048576 : 1.0 / 16777216;
// So near to a domain (window cells) a point that is outside may be inside.
const float kRoom = 1.0 / 65536;

struct Patch {
  vec4 whole_u, rest_u, whole_v, rest_v;  // tile_binning.h: TileEntry
  int slot, holes;
  Rect ramp, domain, samples;
  vec4 slope;
  float quantum, origin, volume, rim, error;
  int grid;
  bool steep;
  mat2 turn;
};

// What copying needs; the rest of a patch is loaded where it is one of several.
Patch load_affine(uint entry) {
  Patch p;
  const int e = int(entry) * kEntry;
  p.whole_u = texelFetch(entries, e), p.rest_u = texelFetch(entries, e + 1);
  p.whole_v = texelFetch(entries, e + 2), p.rest_v = texelFetch(entries, e + 3);
  p.slot = int(p.whole_v.w);
  const vec4 numbers = texelFetch(entries, e + 4);
  p.quantum = numbers.x, p.origin = numbers.y, p.error = numbers.z, p.grid = int(numbers.w);
  const vec4 turn = kGradient ? texelFetch(records, p.slot * kRecord + 6) : vec4(0);
  p.turn = mat2(turn.x, turn.y, turn.z, turn.w);
  return p;
}

void load_rects(inout Patch p) {
  const int r = p.slot * kRecord;
  p.domain = rect_of(texelFetch(records, r + 2));
  if (kPriority) p.ramp = rect_of(texelFetch(records, r + 1)), p.slope = texelFetch(records, r + 4);
  if (kPriority && kMode == kPlain) return;
  const vec4 numbers = texelFetch(records, r + 5);
  p.samples = rect_of(texelFetch(records, r + 3));
  p.volume = numbers.x, p.rim = numbers.y, p.holes = int(numbers.z), p.steep = (uint(numbers.w) & kSteep) != 0;
}

// `d`: columns and rows from the anchor. The whole part is exact, so `precise` only keeps the order of the sums.
Place along(vec4 whole, vec4 rest, vec2 d) {
  precise const float w = whole.x + whole.y * d.x + whole.z * d.y;
  precise const float r = rest.x + rest.y * d.x + rest.z * d.y;
  return Place(w, r);
}

// Metres above the base.
Jet height_of(Patch p, Place u, Place v) {
  const Jet code = interpolate(p.slot, p.origin, u, v);
  precise const float h = p.quantum * code.at + p.rest_v.w;
  return Jet(h, p.quantum * code.u, p.quantum * code.v);
}

struct Point { Sum sum; vec2 at; bool wanted, uncertain, steep; };

Point point_at(uint c, uint r, Tile tile) {
  return Point(nothing(), vec2(c, r), c < tile.across && r < tile.down, false, false);
}

// What the CPU's Batch does with a patch at a point; a patch that does not reach it changes nothing.
void compose(inout Point q, Patch p) {
  if (!q.wanted || (kPriority && q.sum.rest == 0)) return;
  const vec2 d = q.at - vec2(p.whole_u.w, p.rest_u.w);
  const Place u = along(p.whole_u, p.rest_u, d), v = along(p.whole_v, p.rest_v, d);
  const float depth = depth_in(p.domain, u, v);
  q.uncertain = q.uncertain || depth >= -kRoom;
  if (depth < 0) return;
  Jet own = kPriority ? ramp_weight(p.ramp, p.slope, u, v) : wendland_weight(p.domain, u, v);
  bool real_cell = true;
  float error = p.error;
  if (kMode == kHoles) {
    if (depth_in(p.samples, u, v) < -kOnEdge) error += p.rim;
    if (p.holes >= 0) {
      const uint bits = cell_bits(p.holes, u, v);
      if ((bits & 1u) == 0) return;
      real_cell = (bits & 2u) != 0;
      own = times(own, hole_factor(p.holes, u, v));
    }
  }
  add(q.sum, own, own, p.volume, height_of(p, u, v), error, real_cell ? p.grid : -p.grid, p.turn);
  q.steep = q.steep || (kMode == kHoles && p.steep);
}

// Their order does not matter: each is evaluated by itself.
void postpone(uint at) {
  const uint n = atomicAdd(tally.later_count, 1);
  tally.later[n] = at;
  if (n % 64 == 0) atomicAdd(tally.later_groups[0], 1);
}

// What a group counts: patches read, the most at a point, the largest bound.
struct Counted { uint reads, most; float bound; };

// Vertices of the tile that nobody asked for have no data.
void write(Point q, uint t, Answer a, uint reads, bool uncertain, inout Counted n) {
  if (q.at.x >= push.side || q.at.y >= push.side) return;
  const uint at = (t * push.side + uint(q.at.y)) * push.side + uint(q.at.x);
  const bool later = q.wanted && uncertain, any = q.wanted && !later && reads > 0;
  put(at, a, any);
  if (later) postpone(at);
  if (!any) return;
  n.reads += reads, n.most = max(n.most, reads);
  if (a.bound <= push.strict_error) n.bound = max(n.bound, a.bound);
}

void copy(Point q, Patch p, uint t, inout Counted n) {
  const vec2 d = q.at - vec2(p.whole_u.w, p.rest_u.w);
  const Jet h = height_of(p, along(p.whole_u, p.rest_u, d), along(p.whole_v, p.rest_v, d));
  write(q, t, Answer(h.at, p.error, p.turn * vec2(h.u, h.v), p.grid), 1, false, n);
}

void write_sum(Point q, uint t, inout Counted n) {
  write(q, t, finish(q.sum), q.sum.reads, q.steep || (q.uncertain && !(q.sum.plain >= kUncertain)), n);
}

// One atomic a subgroup and counter.
void count(Counted n) {
  const uint all = subgroupAdd(n.reads), largest = subgroupMax(n.most);
  const uint worst = subgroupMax(floatBitsToUint(n.bound));
  if (!subgroupElect()) return;
  atomicAdd(tally.contributions, all);
  atomicMax(tally.most, largest);
  atomicMax(tally.bound_max, worst);
}

void main() {
  const uint item = gl_WorkGroupID.x * 4 + gl_LocalInvocationID.x / 16, blocks = push.blocks * push.blocks;
  if (item >= modes.counts[kMode]) return;
  const uint number = work[kMode * push.tiles * blocks + item], t = number / blocks, block = number % blocks;
  const Tile tile = tiles[t];
  const uint from = tile.lists + block * (tile.count + 1);
  const uint column = block % push.blocks * kBlock + gl_LocalInvocationID.x % 8;
  const uint row = block / push.blocks * kBlock + gl_LocalInvocationID.x / 8 % 2;
  Point a = point_at(column, row, tile), b = point_at(column, row + 2, tile);
  Point c = point_at(column, row + 4, tile), d = point_at(column, row + 6, tile);
  Counted n = Counted(0, 0, 0);
  if (kMode == kCopy) {
    const Patch p = load_affine(tile.first + texelFetch(lists, int(from + 1)).x);
    copy(a, p, t, n), copy(b, p, t, n), copy(c, p, t, n), copy(d, p, t, n);
  } else {
    const uint length = texelFetch(lists, int(from)).x;
    if (length == 0) a.wanted = b.wanted = c.wanted = d.wanted = false;
    // The condition comes last: lavapipe leaves a loop at its end alone.
    uint k = 0;
    do {
      Patch p = load_affine(length == 0 ? 0 : tile.first + texelFetch(lists, int(from + 1 + k)).x);
      load_rects(p);
      compose(a, p), compose(b, p), compose(c, p), compose(d, p);
    } while (++k < length);
    write_sum(a, t, n), write_sum(b, t, n), write_sum(c, t, n), write_sum(d, t, n);
  }
  count(n);
}
