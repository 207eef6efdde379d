#version 450
// A tile whose blocks become meshes: for each vertex of a block, the error of the triangles that it halves.
#extension GL_GOOGLE_include_directive : require
#include "tile_finish.glsl"
#include "mesh_codes.glsl"

// Errors of the triangles of a block (mesh.glsl): of those that vertex (x, y) halves, at place 9 y + x. kNothing for
// those that are partly holes: they are halved until the outline is drawn to a cell.
float worst[81];
float finest;  // of triangles that no vertex halves
bool falls;    // the two triangles of the block are those

void note(ivec2 at, float error) { worst[9 * at.y + at.x] = max(worst[9 * at.y + at.x], error); }

// What the surface does between samples: of cells its largest second differences, and what bends squares of half cells
// from their corners' planes, whose sides those of triangles halve; then metres, of the squares of each size.
vec3 bends[64];
float margins[85];
const int kMargins[] = int[](21, 5, 1, 0);  // of squares of 2, 4, 8, 16 half cells, row by row

float twist_of(int base, ivec2 at) {
  const float a = height_at(base, at), b = height_at(base, at + ivec2(1, 0));
  return abs(a - b - height_at(base, at + ivec2(0, 1)) + height_at(base, at + 1));
}

void note_bend(int base, ivec2 block, ivec2 at, vec2 bend) {
  for (int k = 0; k < 4; ++k) {
    const ivec2 square = at - ivec2(k & 1, k >> 1), cell = square >> 1;
    if (cell != clamp(cell, ivec2(0), ivec2(7))) continue;
    const float twist = k == 0 ? twist_of(base, block + at) : 0;
    bends[8 * cell.y + cell.x] = max(bends[8 * cell.y + cell.x], vec3(bend, isnan(twist) ? 0 : twist));
  }
}

void fill_margins() {
  for (int k = 0; k < 64; ++k) margins[21 + k] = push.between * (bends[k].x + bends[k].y) + 0.25 * bends[k].z;
  for (int s = 1; s < 4; ++s) {
    const int side = 8 >> s;
    for (int k = 0; k < side * side; ++k) {
      const int from = kMargins[s - 1] + 4 * side * (k / side) + 2 * (k % side);
      margins[kMargins[s] + k] = max(max(margins[from], margins[from + 1]),
                                     max(margins[from + 2 * side], margins[from + 2 * side + 1]));
    }
  }
}

// How far the surface lies above and below a triangle, and the fans that others may split it into: along its side on the
// rim they have what it has there, less and less towards the tip.
struct Reach {
  float low, high, rim_low, rim_high;
  bool some, holes;  // samples
};
const Reach kFlat = Reach(0, 0, 0, 0, false, false);
void reach_rim(inout Reach r, float above) { r.rim_low = min(r.rim_low, above), r.rim_high = max(r.rim_high, above); }
// `share`: of the way from the tip to the rim; 0 where no side is on the rim.
void reach(inout Reach r, float height, float plane, float share) {
  const bool hole = isnan(height);
  r.holes = r.holes || hole, r.some = r.some || !hole;
  r.low = min(r.low, height - plane - share * r.rim_high), r.high = max(r.high, height - plane - share * r.rim_low);
}
float error_of(Reach r, float margin) {
  return r.holes ? r.some ? kNothing : 0 : max(r.high, -r.low) + margin;
}

// With the right angle at `corner`, and sides of `size` half cells along u and v. rim: those sides are on it; never both.
float half_error(int base, ivec2 corner, ivec2 u, ivec2 v, int size, bvec2 rim, float margin) {
  const float here = height_at(base, corner);
  const vec2 rise = (vec2(height_at(base, corner + size * u), height_at(base, corner + size * v)) - here) / float(size);
  Reach r = kFlat;
  for (int k = 1; rim.x && k < size; ++k) reach_rim(r, height_at(base, corner + k * u) - here - rise.x * float(k));
  for (int k = 1; rim.y && k < size; ++k) reach_rim(r, height_at(base, corner + k * v) - here - rise.y * float(k));
  const vec2 nearer = vec2(rim) / float(size);
  for (int k = 0; k <= size; ++k)
    for (int j = 0; j <= size - k; ++j)
      reach(r, height_at(base, corner + k * u + j * v), here + dot(rise, vec2(k, j)), dot(nearer, vec2(size - j, size - k)));
  return error_of(r, margin);
}

// With the right angle in the middle of a square, and the longest side, 2 size half cells along v, u away from it.
float quarter_error(int base, ivec2 middle, ivec2 u, int size, bool rim, float margin) {
  const ivec2 v = ivec2(-u.y, u.x);
  const float here = height_at(base, middle);
  const float first = height_at(base, middle + size * (u - v)), last = height_at(base, middle + size * (u + v));
  const float rise = (0.5 * (first + last) - here) / float(size), along = (last - first) / float(2 * size);
  Reach r = kFlat;
  for (int j = 1 - size; rim && j < size; ++j)
    reach_rim(r, height_at(base, middle + size * u + j * v) - here - rise * float(size) - along * float(j));
  for (int k = 0; k <= size; ++k)
    for (int j = -k; j <= k; ++j)
      reach(r, height_at(base, middle + k * u + j * v), here + rise * float(k) + along * float(j),
            rim ? float(k) / float(size) : 0);
  return error_of(r, margin);
}

// With shortest sides: how far the surface lies above the middles of the longest and of the others, before and after one
// on the rim is halved. rim: never both.
float shortest_error(float longest, vec2 others, bvec2 rim) {
  const vec3 whole = vec3(longest, others);
  if (any(isnan(whole))) return 0;
  const float split = rim.x ? others.x : rim.y ? others.y : 0;
  const vec3 most = max(abs(whole), abs(whole - 0.5 * split * vec3(1, vec2(not(rim)))));
  return max(most.x, max(most.y, most.z));
}

void measure_cell(int base, ivec2 from, bool drop, bvec4 rim, float margin) {
  const ivec2 x = ivec2(1, 0), y = ivec2(0, 1);
  const float a = height_at(base, from), b = height_at(base, from + 2 * x);
  const float c = height_at(base, from + 2), d = height_at(base, from + 2 * y);
  const float longest = height_at(base, from + 1) - 0.5 * (drop ? b + d : a + c);
  const vec4 sides = vec4(height_at(base, from + y), height_at(base, from + 2 * x + y), height_at(base, from + x),
                          height_at(base, from + x + 2 * y)) - 0.5 * vec4(a + d, b + c, a + b, c + d);
  const float one = shortest_error(longest, drop ? sides.xz : sides.yz, drop ? rim.xz : rim.yz);
  const float other = shortest_error(longest, drop ? sides.yw : sides.xw, drop ? rim.yw : rim.xw);
  finest = max(finest, max(one, other) + margin);
}

// A square of `size` half cells, `at` squares from the block's corner: halved along the diagonal that the mesh has
// there, and quartered around its middle. `rim`: sides along which others may split triangles.
void measure_square(int base, ivec2 block, ivec2 at, int size, bvec4 rim, float margin) {
  const ivec2 from = block + size * at, middle = (2 * at + 1) * size / 4, x = ivec2(1, 0), y = ivec2(0, 1);
  const ivec2 a = from, b = from + size * x, c = from + size, d = from + size * y;
  const bool drop = ((at.x ^ at.y) & 1) != 0;
  if (size == 2) {
    measure_cell(base, from, drop, rim, margin);
    return;
  }
  if (size == kBlockSamples) {
    const bvec2 none = bvec2(false);  // it is quartered before others split its sides
    const float rises =
        max(half_error(base, b, -x, y, size, none, margin), half_error(base, d, x, -y, size, none, margin));
    const float drops =
        max(half_error(base, a, x, y, size, none, margin), half_error(base, c, -x, -y, size, none, margin));
    falls = drops < rises;
    note(middle, min(rises, drops));
  } else {
    const ivec2 across = drop ? x : -x;
    const float one = half_error(base, drop ? a : b, across, y, size, bvec2(rim.z, drop ? rim.x : rim.y), margin);
    const float other = half_error(base, drop ? c : d, -across, -y, size, bvec2(rim.w, drop ? rim.y : rim.x), margin);
    note(middle, max(one, other));
  }
  const int reaches = size / 4;
  note(middle - reaches * x, quarter_error(base, from + size / 2, -x, size / 2, rim.x, margin));
  note(middle + reaches * x, quarter_error(base, from + size / 2, x, size / 2, rim.y, margin));
  note(middle - reaches * y, quarter_error(base, from + size / 2, -y, size / 2, rim.z, margin));
  note(middle + reaches * y, quarter_error(base, from + size / 2, y, size / 2, rim.w, margin));
}

// No vertex without those whose triangles it halves: its error is at least that of what hangs on it.
void close_errors() {
  for (int size = 1; size < 8; size *= 2) {
    for (int y = size; y < 8; y += 2 * size)
      for (int x = size; x < 8; x += 2 * size)
        for (int k = 0; k < 4; ++k) {
          const ivec2 hangs = ivec2(x, y) + size * ivec2(k == 0 ? -1 : k == 1 ? 1 : 0, k == 2 ? -1 : k == 3 ? 1 : 0);
          note(ivec2(x, y), worst[9 * hangs.y + hangs.x]);
        }
    if (size == 4) return;
    // Middles of sides of the squares that are twice as large.
    for (int y = 0; y <= 8; y += 2 * size)
      for (int x = 0; x <= 8; x += 2 * size) {
        if (((x ^ y) & 2 * size) == 0) continue;
        for (int k = 0; k < 4; ++k) {
          const ivec2 hangs = ivec2(x, y) + size * ivec2((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1);
          if (hangs == clamp(hangs, ivec2(0), ivec2(8))) note(ivec2(x, y), worst[9 * hangs.y + hangs.x]);
        }
      }
  }
}

// Where the vertices of mesh.glsl's bits lie.
int place_of(int bit) {
  if (bit < 64) return bit < 49 ? 9 * (bit / 7) + bit % 7 + 10 : 0;
  const int s = (bit - 64) / 8, p = bit % 8, across = (s & 1) * 8;
  return s < 2 ? 9 * p + across : 9 * across + p;
}

// Four blocks as one square, measured by all four: each has one of its quarters and one of the halves at its corner.
shared vec3 shares[64];  // margin, half, quarter

uvec3 quad_errors(int base, int b, float margin) {
  const ivec2 at = ivec2(b % 8, b / 8), in_quad = at & 1, middle = (at | 1) * kBlockSamples;
  const int rep = b - in_quad.x - 8 * in_quad.y, size = kBlockSamples;
  shares[b].x = margin;
  barrier();
  margin = max(max(shares[rep].x, shares[rep + 1].x), max(shares[rep + 8].x, shares[rep + 9].x));
  const ivec2 inward = 1 - 2 * in_quad, corner = middle - size * inward;
  const ivec2 sides[] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));
  const int which = in_quad.x + 2 * in_quad.y;
  shares[b].y = half_error(base, corner, ivec2(inward.x, 0), ivec2(0, inward.y), 2 * size, bvec2(false), margin);
  shares[b].z = quarter_error(base, middle, sides[which], size, true, margin);
  barrier();
  const float drops = max(shares[rep].y, shares[rep + 9].y), rises = max(shares[rep + 1].y, shares[rep + 8].y);
  const float quarters = max(max(shares[rep].z, shares[rep + 1].z), max(shares[rep + 8].z, shares[rep + 9].z));
  return uvec3(floatBitsToUint(min(drops, rises)), floatBitsToUint(quarters), drops < rises ? 1 : 0);
}

int code_of(float error) { return (floatBitsToInt(error) + (1 << kCodeShift) - 1) >> kCodeShift; }

// The block's errors, from metres to codes: the steps of floats with four bits of fraction, rounded up, from the
// largest down. 255 needs its vertices whatever is allowed.
int write_codes(int first, uvec3 quad) {
  float largest = 0;
  for (int k = 0; k < 81; ++k) largest = worst[k] < kNothing ? max(largest, worst[k]) : largest;
  const int zero = code_of(largest) - 254;
  for (int k = 0; k < 6; ++k) {
    uvec4 codes = uvec4(0);
    for (int b = 0; b < 16; ++b) {
      const float error = worst[place_of(16 * k + b)];
      codes[b >> 2] |= uint(error < kNothing ? clamp(code_of(error) - zero, 0, 254) : 255) << (8 * (b & 3));
    }
    blocks[first + k] = k + 1 == kQuadErrors ? uvec4(codes.x, quad) : codes;
  }
  return zero;
}

void measure(int base, int bound_base, int slot, int b) {
  const ivec2 here = ivec2(b % 8, b / 8), block = here * kBlockSamples;
  for (int k = 0; k < 64; ++k) bends[k] = vec3(0);
  const BlockFacts f = facts_of(base, bound_base, b);
  fill_margins();
  for (int k = 0; k < 81; ++k) worst[k] = 0;
  finest = 0, falls = false;
  for (int s = 0; s < 4 && f.low <= f.high; ++s) {
    const int size = kBlockSamples >> s, last = kBlockSamples / size - 1;
    for (int k = 0; k < (last + 1) * (last + 1); ++k) {
      const ivec2 at = ivec2(k % (last + 1), k / (last + 1));
      bvec4 rim = bvec4(at.x == 0, at.x == last, at.y == 0, at.y == last);
      // Only finer tiles split the shortest sides.
      const bvec4 tile_rim = bvec4(here.x == 0, here.x == 7, here.y == 0, here.y == 7);
      if (size == 2) rim = bvec4(ivec4(rim) * ivec4(tile_rim));
      measure_square(base, block, at, size, rim, margins[kMargins[3 - s] + k]);
    }
  }
  close_errors();
  const int first = (slot * 64 + b) * kBlock;
  const int zero = write_codes(first + 1, quad_errors(base, b, margins[0]));
  const float between = push.between * (f.bend.x + f.bend.y), lack = reducible(b, f.bound);
  const vec2 range = vec2(f.low + push.shift - between, f.high + push.shift + between);
  blocks[first] = uvec4(floatBitsToUint(range), zero << kFlagBits | int(holes_along(base, block) << kHolesShift) | (falls ? 1 : 0), floatBitsToUint(lack));
  note_facts(b, f, between, finest, lack);
}
