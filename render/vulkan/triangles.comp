#version 450
// The triangles of each block, as names of vertices, one draw after the other, and which of them each group of draws
// has. Counterclockwise from above.
#extension GL_GOOGLE_include_directive : require
#include "mesh.glsl"

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 5) uniform usamplerBuffer needs;
layout(binding = 7) uniform usamplerBuffer edges;   // mesh_edges.comp
layout(binding = 9) uniform usamplerBuffer counts;
layout(binding = 10) writeonly buffer Indices { uint indices[]; };
layout(binding = 11) writeonly buffer Calls { uint calls[]; };  // VkDrawIndexedIndirectCommand of each group
layout(binding = 12) readonly buffer Firsts { uvec2 firsts[]; };  // of each group: its first draw, the one behind it
layout(push_constant) uniform Push { uint groups; } push;

const int kSide = 2 * kBlockCells;

shared uint parts[64], sum;

int first_draw;   // the draw, and where its block begins
ivec2 origin;
uint place;       // in indices

void put(ivec2 a, ivec2 b, ivec2 c) {
  indices[place] = name_of(first_draw, origin + a);
  indices[place + 1] = name_of(first_draw, origin + b);
  indices[place + 2] = name_of(first_draw, origin + c);
  place += 3;
}

bool has_inside(uvec2 inside, ivec2 cell) {
  const int k = 7 * cell.y + cell.x - 8;
  return ((k < 32 ? inside.x >> k : inside.y >> (k - 32)) & 1u) != 0;
}

// Vertices inside of a block as a set: in those columns and rows.
uvec2 lattice(uint columns, uint rows) {
  uvec2 all = uvec2(0);
  for (int r = 0; r < 7; ++r) {
    const uint row = (rows >> r & 1u) != 0 ? columns : 0;
    if (r < 5) all.x |= row << (7 * r);
    if (r == 4) all.y |= row >> 4;
    if (r > 4) all.y |= row << (7 * r - 32);
  }
  return all;
}
// What of a set lies beside vertices, by them.
uvec2 beside(uvec2 set, ivec2 to) {
  const int by = 7 * to.y + to.x;
  return by > 0 ? uvec2(set.x >> by | set.y << (32 - by), set.y >> by)
                : uvec2(set.x << -by, set.y << -by | set.x >> (32 + by));
}

const uint kOdd = 0x55u, kEven = 0x2au, kFour = 0x08u, kTwo = 0x02u, kSix = 0x20u;  // of columns and rows 1 to 7

// The vertices inside that have a triangle with the right angle there whose longest side lies to one of eight
// sides of them, but for those along the block's edges: the vertex that would halve it is not there.
uvec2 halved_to(uvec2 inside, int k) {
  const ivec2 to = ivec2((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1);
  if (k < 4)  // middles of sides of squares
    return inside & (lattice(kOdd, kEven) | lattice(kEven, kOdd) |
                     (lattice(kFour, kTwo | kSix) | lattice(kTwo | kSix, kFour)) & ~beside(inside, to));
  // Middles of squares.
  const bool across = k >= 6, up = (k & 1) != 0;
  const uint near = up ? 0x15u : 0x54u, far = up ? kTwo : kSix;
  const ivec2 step = across ? ivec2(0, to.x) : ivec2(to.x, 0);
  const uvec2 small = across ? lattice(kOdd, near) : lattice(near, kOdd);
  const uvec2 large = across ? lattice(kTwo | kSix, far) : lattice(far, kTwo | kSix);
  return inside & (small & ~beside(inside, step) | large & ~beside(inside, 2 * step));
}

void put_inside(uvec2 inside) {
  uvec2 sets[8];
  for (int k = 0; k < 8; ++k) sets[k] = halved_to(inside, k);
  int k = 0;
  uvec2 left = sets[0];
  while (true) {
    while ((left.x | left.y) == 0 && k < 7) left = sets[++k];
    if ((left.x | left.y) == 0) return;
    const int bit = left.x != 0 ? findLSB(left.x) : 32 + findLSB(left.y);
    if (left.x != 0)
      left.x &= left.x - 1;
    else
      left.y &= left.y - 1;
    const ivec2 cell = ivec2(bit % 7, bit / 7) + 1;
    const int size = (cell.x | cell.y) & -(cell.x | cell.y), sign = (k & 1) != 0 ? size : -size;
    ivec2 to = ivec2(sign, (k & 2) != 0 ? size : -size);
    if (k >= 4) to = k >= 6 ? ivec2(0, 2 * sign) : ivec2(2 * sign, 0);
    const ivec2 across = ivec2(-to.y, to.x);
    put(2 * cell, 2 * cell + to - across, 2 * cell + to + across);
  }
}

// Half cells along and away from side s of a square.
ivec2 from_side(int s, int along, int away, int side) {
  const int across = (s & 1) != 0 ? side - away : away;
  return s < 2 ? ivec2(across, along) : ivec2(along, across);
}

// The triangles along the block's edges, one for each segment between the vertices of `split` (half cells): fans
// around the right angle or the end of the block's own triangle there, whose side lies between two of its vertices
// `edges` (cells).
void put_along(uvec2 inside, uint edges, uvec2 split) {
  int s = 0, from = 0, own_from = 0;
  uint own = 0, left = 0;
  while (true) {
    if (left == 0) {
      own = edges >> (8 * s) & 0xffu | 1u << kBlockCells;
      left = (s < 2 ? split.x : split.y) >> (16 * (s & 1)) & 0xffffu | 1u << kSide;
      from = own_from = 0;
    }
    const int to = findLSB(left), own_to = findLSB(own >> (own_from + 1)) + own_from + 1;
    const int size = own_to - own_from, half_size = size / 2;
    ivec2 apex = ivec2((own_from & size) != 0 ? own_from : own_to, size);
    if (size > 1 && has_inside(inside, from_side(s, own_from + own_to, size, kSide) / 2))
      apex = ivec2(own_from + half_size, half_size);
    const bool ahead = s == 1 || s == 2;
    put(from_side(s, ahead ? from : to, 0, kSide), from_side(s, ahead ? to : from, 0, kSide),
        from_side(s, 2 * apex.x, 2 * apex.y, kSide));
    from = to, left &= left - 1;
    if (to == 2 * own_to) own_from = own_to;
    if (left == 0 && ++s == 4) return;
  }
}

void put_square(int side, bool falls) {
  const ivec2 a = ivec2(0), b = ivec2(side, 0), c = ivec2(side), d = ivec2(0, side);
  if (falls)
    put(a, b, d), put(b, c, d);
  else
    put(a, b, c), put(a, c, d);
}

// Fans around the middle of a quad, one triangle for each segment between the vertices of `split` (half cells).
void put_fans(uvec4 split) {
  const int side = 2 * kSide;
  int s = 0, from = 0;
  while (s < 4) {
    const uint left = from == 31 ? 0 : split[s] >> (from + 1);
    const int to = left != 0 ? from + 1 + findLSB(left) : side;
    const bool ahead = s == 1 || s == 2;
    put(from_side(s, ahead ? from : to, 0, side), from_side(s, ahead ? to : from, 0, side), ivec2(kSide));
    from = to;
    if (to == side) ++s, from = 0;
  }
}

void put_block(Mesh mesh, uvec2 split) {
  if ((mesh.inside.x | mesh.inside.y | split.x | split.y) == 0) {
    put_square(kSide, mesh.falls);
    return;
  }
  const uint middle = 1u << 24;  // wherever an edge is split
  mesh.inside.x |= middle;
  put_inside(mesh.inside);
  put_along(mesh.inside, mesh.edges, split);
}

// Triangles of draws [from, to), for all of the workgroup. Called by all of it.
uint triangles_of(int from, int to) {
  const int b = int(gl_LocalInvocationID.x);
  uint part = 0;
  for (int k = from + b; k < to; k += 64) part += texelFetch(counts, k).x;
  barrier();
  parts[b] = part;
  barrier();
  for (int k = 1; b < 8 && k < 8; ++k) part += parts[8 * k + b];
  if (b < 8) parts[b] = part;
  barrier();
  for (int k = 1; b == 0 && k < 8; ++k) part += parts[k];
  if (b == 0) sum = part;
  barrier();
  return sum;
}

void main() {
  const int d = int(gl_WorkGroupID.x), b = int(gl_LocalInvocationID.x);
  const Mesh mesh = unpacked(texelFetch(needs, d * 64 + b));
  const uvec4 edge = texelFetch(edges, d * 64 + b);
  const uint draws_before = triangles_of(0, d);
  for (uint g = 0; g < push.groups; ++g) {
    if (firsts[g].x != uint(d)) continue;
    const uint all = triangles_of(d, int(firsts[g].y));
    if (b == 0) calls[5 * g] = 3 * all, calls[5 * g + 2] = 3 * draws_before;
  }
  const bool in_quad = (mesh.quad & kQuad) != 0;
  if (in_quad ? (b & 9) != 0 : !mesh.seen) return;
  first_draw = d, origin = ivec2(b % kBlocks, b / kBlocks) * kSide;
  place = 3 * (draws_before + edge.w);
  if (in_quad) {
    const uvec4 split = texelFetch(edges, d * 64 + b + 1);
    if ((mesh.quad & kFlat) != 0 && split == uvec4(0))
      put_square(2 * kSide, (mesh.quad & kQuadFalls) != 0);
    else
      put_fans(split);
  } else {
    put_block(mesh, edge.xy);
  }
}
