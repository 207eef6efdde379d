// What every shader of the blend shares: bindings (in the order of frame.cpp), layouts, and the mathematics
// of blend/weight.h and db/basis.h over `real`, which the including shader defines as float or double.
// Places in a patch are window coordinates (db/patch_surface.h).

const int kSide = 41;                      // vertices of a window along each side: PatchSurface::kSide
const int kSamples = kSide * kSide;
const int kBlock = 8;                      // points of a block along each side
const real kOnEdge = real(1.0) / 1048576;  // of a cell: nearer to an edge than this a point lies on it
const real kHoleFeather = real(8);         // the distance of full weight: kFeatherCells

layout(constant_id = 0) const int kSmoothness = 0;
layout(constant_id = 1) const bool kPriority = true;
layout(constant_id = 2) const bool kGradient = false;
layout(constant_id = 3) const bool kBound = true;   // planes of the results
layout(constant_id = 4) const bool kSource = true;
layout(constant_id = 5) const int kMode = 0;        // of blend.comp

layout(binding = 0) uniform samplerBuffer samples;   // codes; kSamples a slot
layout(binding = 1) uniform usamplerBuffer words;    // the same slots where they hold a patch's holes
layout(binding = 2) uniform samplerBuffer records;   // kRecord texels a slot: PatchPool's record
layout(binding = 3) readonly buffer Exact { double exact[]; };  // kExactRecord a slot
layout(binding = 4) uniform samplerBuffer entries;   // kEntry texels: TileEntry of tile_binning.h
layout(binding = 6) uniform usamplerBuffer lists;    // of a block: its length, then places among its tile's entries
layout(binding = 7) writeonly buffer Results { uint results[]; };
layout(binding = 9) readonly buffer Points { double points[]; };  // x, y; metres

const int kRecord = 7, kExactRecord = 32, kEntry = 5;
// Bits of a record's kind: PatchKind of patch_pool_impl.h.
const uint kSolid = 1u, kWithoutHoles = 2u, kSteep = 4u << uint(kSmoothness);

// What is done with a block; each mode has a work list and a pipeline of its own, because lavapipe runs both sides
// of every branch.
const int kCopy = 0;   // one patch holds it in its kernel
const int kPlain = 1;  // patches without holes, samples up to their rims
const int kHoles = 2;  // any patches
const int kLater = 3;  // single points, in double

struct Tile {
  uint first, count;   // entries
  uint lists;          // where the lists of its blocks begin, each count + 1 long
  int c0, r0, stride;  // vertex (c, r) is vertex (c0 + stride c, r0 + stride r) of the lattice
  int across, down;    // vertices that are wanted
};
layout(binding = 5) readonly buffer Tiles { Tile tiles[]; };

// What classify.comp found: of the first three modes, the groups of an indirect dispatch (x y z) and the items of
// the work list. Apart from the tally, which dispatches that run side by side write.
layout(binding = 12) buffer Modes {
  uint groups[9];
  uint counts[3];
} modes;

layout(binding = 8) buffer Tally {
  uint later_groups[3], later_count;    // of kLater
  uint contributions, most, bound_max;  // bound_max: bits of a float, which order as their values
  uint outs, insides, partials;         // of (block, patch) pairs
  uint later[];                         // work list of kLater: places in the results
} tally;

// Block b of tile t is number t blocks^2 + b; a list for each of the first three modes, room for all in each.
layout(binding = 11) buffer WorkLists { uint work[]; };

layout(push_constant) uniform Push {
  double x0, xc, xr, y0, yc, yr;  // the lattice
  double base;                    // metres: heights are written relative to it
  uint side, blocks;              // of a tile, vertices and blocks along each side
  uint bound_at, source_at, gradient_at;  // where planes begin in `results`; 0: not wanted
  float strict_error;  // infinity: answers are given at any error
  uint explicit_points;  // not 0: points in groups of 64, a tile each; results in double
  uint classify;       // 0: every entry of a tile goes to every block
  uint tiles;          // how many there are; their buffer may be larger
} push;

// A coordinate along one axis as whole + rest, so that differences to nearby numbers lose nothing.
struct Place { real whole, rest; };
// How far past a number, and how far short of it.
real beyond(Place p, real rim) { return (p.whole - rim) + p.rest; }
real before(Place p, real rim) { return (rim - p.whole) - p.rest; }
int cell_at(Place p) { return clamp(int(p.whole + p.rest), 1, kSide - 3); }

// A value with its derivatives along u and v.
struct Jet { real at, u, v; };

// Rises from 0 at t <= 0 to 1 at t >= 1; .y is the derivative.
vec2_ smooth_step(real t) {
  t = clamp(t, real(0), real(1));
  if (kSmoothness == 0) return vec2_(t, t > 0 && t < 1 ? 1 : 0);
  if (kSmoothness == 1) return vec2_(t * t * (3 - 2 * t), 6 * t * (1 - t));
  return vec2_(t * t * t * (10 + t * (6 * t - 15)), 30 * t * t * (1 - t) * (1 - t));
}

// Of the distance from the rim, in half sides: Wendland's function; .y is the derivative.
vec2_ wendland(real s) {
  s = clamp(s, real(0), real(1));
  if (kSmoothness == 0) return vec2_(s, 1);
  return vec2_(s * s * s * (4 - 3 * s), 12 * s * s * (1 - s));
}

// Of a function of u alone and one of v alone.
Jet product(vec2_ s, real du, vec2_ t, real dv) { return Jet(s.x * t.x, s.y * du * t.x, t.y * dv * s.x); }

struct Rect { real i0, j0, i1, j1; };
Rect rect_of(vec4_ r) { return Rect(r.x, r.y, r.z, r.w); }

// How far inside a rectangle; negative outside.
real depth_in(Rect r, Place u, Place v) {
  return min(min(beyond(u, r.i0), before(u, r.i1)), min(beyond(v, r.j0), before(v, r.j1)));
}

// `slope`: 1 / width of the ramps at i0, j0, i1, j1.
Jet ramp_weight(Rect ramp, vec4_ slope, Place u, Place v) {
  const real i0 = beyond(u, ramp.i0) * slope.x, i1 = before(u, ramp.i1) * slope.z;
  const real j0 = beyond(v, ramp.j0) * slope.y, j1 = before(v, ramp.j1) * slope.w;
  return product(smooth_step(min(i0, i1)), i0 < i1 ? slope.x : -slope.z, smooth_step(min(j0, j1)),
                 j0 < j1 ? slope.y : -slope.w);
}

// Both axes' distances from the nearer rim, so that nothing cancels where the weight is small.
Jet wendland_weight(Rect domain, Place u, Place v) {
  const real du = 2 / (domain.i1 - domain.i0), dv = 2 / (domain.j1 - domain.j0);
  const real i0 = beyond(u, domain.i0), i1 = before(u, domain.i1);
  const real j0 = beyond(v, domain.j0), j1 = before(v, domain.j1);
  return product(wendland(min(i0, i1) * du), i0 < i1 ? du : -du, wendland(min(j0, j1) * dv),
                 j0 < j1 ? dv : -dv);
}

// db/basis.h: weights of the samples before the cell, at its far end and beyond, and their derivatives.
void cell_weights(real t, out vec3_ w, out vec3_ d) {
  const real s = 1 - t;
  if (kSmoothness == 1) {
    w.x = -0.5 * t * (s * s), w.z = -0.5 * s * (t * t);
    d.x = -0.5 * s * (s - 2 * t), d.z = -0.5 * t * (2 * s - t);
  } else {
    w.x = t * (-0.5 + t * (0.5 + t * (1.5 + t * (-2.5 + t))));
    w.z = s * (-0.5 + s * (0.5 + s * (1.5 + s * (-2.5 + s))));
    d.x = -0.5 + t * (1 + t * (4.5 + t * (-10 + 5 * t)));
    d.z = 0.5 - s * (1 + s * (4.5 + s * (-10 + 5 * s)));
  }
  w.y = t + w.x - 2 * w.z, d.y = 1 + d.x - 2 * d.z;
}

real code_at(int at) { return real(texelFetch(samples, at).x); }

// `at`: the near vertex of the cell; differences of codes are exact.
Jet bilinear(int at, real origin, real s, real t) {
  const real a = code_at(at) - origin, b = code_at(at + 1) - origin;
  const real c = code_at(at + kSide) - origin, d = code_at(at + kSide + 1) - origin;
  const real low = a + s * (b - a), high = c + s * (d - c);
  return Jet(low + t * (high - low), (b - a) + t * ((d - c) - (b - a)), high - low);
}

// Of one row: its value and its derivative.
vec2_ row_of(int at, real origin, vec3_ w, vec3_ dw) {
  const real b = code_at(at + 1);
  const vec3_ d = vec3_(code_at(at) - b, code_at(at + 2) - b, code_at(at + 3) - b);
  return vec2_((b - origin) + (w.x * d.x + w.y * d.y + w.z * d.z), dw.x * d.x + dw.y * d.y + dw.z * d.z);
}

// Along u first, then across the four rows.
Jet bicubic(int at, real origin, real s, real t) {
  vec3_ w, dw, y, dy;
  cell_weights(s, w, dw);
  cell_weights(t, y, dy);
  const vec2_ a = row_of(at - kSide - 1, origin, w, dw), b = row_of(at - 1, origin, w, dw);
  const vec2_ c = row_of(at + kSide - 1, origin, w, dw), d = row_of(at + 2 * kSide - 1, origin, w, dw);
  const vec3_ e = vec3_(a.x - b.x, c.x - b.x, d.x - b.x);
  return Jet(b.x + (y.x * e.x + y.y * e.y + y.z * e.z),
             b.y + (y.x * (a.y - b.y) + y.y * (c.y - b.y) + y.z * (d.y - b.y)),
             dy.x * e.x + dy.y * e.y + dy.z * e.z);
}

// Codes of a slot relative to `origin`.
Jet interpolate(int slot, real origin, Place u, Place v) {
  const int i = cell_at(u), j = cell_at(v), at = slot * kSamples + j * kSide + i;
  const real s = beyond(u, real(i)), t = beyond(v, real(j));
  if (kSmoothness == 0) return bilinear(at, origin, s, t);
  return bicubic(at, origin, s, t);
}
