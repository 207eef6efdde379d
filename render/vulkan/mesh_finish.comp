#version 450
// A tile whose blocks become meshes: for each vertex of a block, the error of the triangles that it halves.
#extension GL_GOOGLE_include_directive : require
const bool kTwisting = true;
#include "tile_finish.glsl"
#include "mesh_codes.glsl"

// Errors of the triangles of a block (mesh.glsl): of those that vertex (x, y) halves, at place 9 y + x.
float worst[81];
float finest;  // of triangles that no vertex halves
bool falls;    // the two triangles of the block are those

void note(ivec2 at, float error) { worst[9 * at.y + at.x] = max(worst[9 * at.y + at.x], error); }

// How far the surface lies above and below a triangle: low, high; and along its side on the rim, where others may
// split it.
const vec4 kFlat = vec4(0);
void reach(inout vec4 r, float above) { r.x = min(r.x, above), r.y = max(r.y, above); }
void reach_rim(inout vec4 r, float above) { r.z = min(r.z, above), r.w = max(r.w, above); }
// A fan in a triangle has what it has along the rim, less and less towards the tip.
float error_of(vec4 r) { return max(r.y - r.z, r.w - r.x); }

// With the right angle at `corner`, and sides of `size` half cells along u and v. rim: those sides are on it.
float half_error(int base, ivec2 corner, ivec2 u, ivec2 v, int size, bvec2 rim) {
  const float here = height_at(base, corner);
  const vec2 rise = vec2(height_at(base, corner + size * u), height_at(base, corner + size * v)) - here;
  vec4 r = kFlat;
  for (int k = 0; k <= size; ++k)
    for (int j = 0; j <= size - k; ++j)
      reach(r, height_at(base, corner + k * u + j * v) - here - dot(rise, vec2(k, j)) / float(size));
  for (int k = 1; rim.x && k < size; ++k)
    reach_rim(r, height_at(base, corner + k * u) - here - rise.x * float(k) / float(size));
  for (int k = 1; rim.y && k < size; ++k)
    reach_rim(r, height_at(base, corner + k * v) - here - rise.y * float(k) / float(size));
  return error_of(r);
}

// With the right angle in the middle of a square, and the longest side, 2 size half cells along v, u away from it.
float quarter_error(int base, ivec2 middle, ivec2 u, int size, bool rim) {
  const ivec2 v = ivec2(-u.y, u.x);
  const float here = height_at(base, middle);
  const float first = height_at(base, middle + size * (u - v)), last = height_at(base, middle + size * (u + v));
  const float rise = (0.5 * (first + last) - here) / float(size), along = (last - first) / float(2 * size);
  vec4 r = kFlat;
  for (int k = 0; k <= size; ++k)
    for (int j = -k; j <= k; ++j)
      reach(r, height_at(base, middle + k * u + j * v) - here - rise * float(k) - along * float(j));
  for (int j = 1 - size; rim && j < size; ++j)
    reach_rim(r, height_at(base, middle + size * u + j * v) - here - rise * float(size) - along * float(j));
  return error_of(r);
}

// With shortest sides: how far the surface lies above the middles of the longest and of the others.
float shortest_error(float longest, vec2 others, bvec2 rim) {
  const vec2 on_rim = others * vec2(rim);
  return error_of(vec4(min(min(longest, 0), min(others.x, others.y)), max(max(longest, 0), max(others.x, others.y)),
                       min(min(on_rim.x, on_rim.y), 0), max(max(on_rim.x, on_rim.y), 0)));
}

void measure_cell(int base, ivec2 from, bool drop, bvec4 rim) {
  const ivec2 x = ivec2(1, 0), y = ivec2(0, 1);
  const float a = height_at(base, from), b = height_at(base, from + 2 * x);
  const float c = height_at(base, from + 2), d = height_at(base, from + 2 * y);
  const float longest = height_at(base, from + 1) - 0.5 * (drop ? b + d : a + c);
  const vec4 sides = vec4(height_at(base, from + y), height_at(base, from + 2 * x + y), height_at(base, from + x),
                          height_at(base, from + x + 2 * y)) - 0.5 * vec4(a + d, b + c, a + b, c + d);
  const float one = shortest_error(longest, drop ? sides.xz : sides.yz, drop ? rim.xz : rim.yz);
  const float other = shortest_error(longest, drop ? sides.yw : sides.xw, drop ? rim.yw : rim.xw);
  finest = max(finest, max(one, other));
}

// A square of `size` half cells, `at` squares from the block's corner: halved along the diagonal that the mesh has
// there, and quartered around its middle. `rim`: sides along which others may split triangles.
void measure_square(int base, ivec2 block, ivec2 at, int size, bvec4 rim) {
  const ivec2 from = block + size * at, middle = (2 * at + 1) * size / 4, x = ivec2(1, 0), y = ivec2(0, 1);
  const ivec2 a = from, b = from + size * x, c = from + size, d = from + size * y;
  const bool drop = ((at.x ^ at.y) & 1) != 0;
  if (size == 2) {
    measure_cell(base, from, drop, rim);
    return;
  }
  if (size == kBlockSamples) {
    const bvec2 none = bvec2(false);  // it is quartered before others split its sides
    const float rises = max(half_error(base, b, -x, y, size, none), half_error(base, d, x, -y, size, none));
    const float drops = max(half_error(base, a, x, y, size, none), half_error(base, c, -x, -y, size, none));
    falls = drops < rises;
    note(middle, min(rises, drops));
  } else {
    const ivec2 across = drop ? x : -x;
    const float one = half_error(base, drop ? a : b, across, y, size, bvec2(rim.z, drop ? rim.x : rim.y));
    const float other = half_error(base, drop ? c : d, -across, -y, size, bvec2(rim.w, drop ? rim.y : rim.x));
    note(middle, max(one, other));
  }
  const int reaches = size / 4;
  note(middle - reaches * x, quarter_error(base, from + size / 2, -x, size / 2, rim.x));
  note(middle + reaches * x, quarter_error(base, from + size / 2, x, size / 2, rim.y));
  note(middle - reaches * y, quarter_error(base, from + size / 2, -y, size / 2, rim.z));
  note(middle + reaches * y, quarter_error(base, from + size / 2, y, size / 2, rim.w));
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

// The block's errors, from metres to codes: the steps of floats with four bits of fraction, rounded up, from the
// largest down. 255 needs its vertices whatever is allowed.
int write_codes(int first, float more, bool holes) {
  const int top = (floatBitsToInt(worst[40] + more) + (1 << kCodeShift) - 1) >> kCodeShift, zero = top - 254;
  for (int k = 0; k < 6; ++k) {
    uvec4 codes = uvec4(0);
    for (int b = 0; b < 16; ++b) {
      const int code = (floatBitsToInt(worst[place_of(16 * k + b)] + more) + (1 << kCodeShift) - 1) >> kCodeShift;
      codes[b >> 2] |= uint(holes ? 255 : clamp(code - zero, 0, 254)) << (8 * (b & 3));
    }
    blocks[first + k] = codes;
  }
  return zero;
}

void measure(int base, int bound_base, int slot, int b) {
  const ivec2 here = ivec2(b % 8, b / 8), block = here * kBlockSamples;
  const BlockFacts f = facts_of(base, bound_base, block);
  const float between = push.between * (f.bend.x + f.bend.y);
  // Sides of triangles halve the squares between samples, too.
  const float more = between + 0.25 * f.twist;
  for (int k = 0; k < 81; ++k) worst[k] = 0;
  finest = 0, falls = false;
  for (int size = kBlockSamples; !f.holes && size >= 2; size /= 2) {
    const int last = kBlockSamples / size - 1;
    for (int k = 0; k < (last + 1) * (last + 1); ++k) {
      const ivec2 at = ivec2(k % (last + 1), k / (last + 1));
      bvec4 rim = bvec4(at.x == 0, at.x == last, at.y == 0, at.y == last);
      // Only finer tiles split the shortest sides.
      const bvec4 tile_rim = bvec4(here.x == 0, here.x == 7, here.y == 0, here.y == 7);
      if (size == 2) rim = bvec4(ivec4(rim) * ivec4(tile_rim));
      measure_square(base, block, at, size, rim);
    }
  }
  if (!f.holes) close_errors();
  const int first = (slot * 64 + b) * kBlock;
  const int zero = write_codes(first + 1, more, f.holes);
  const vec2 range = vec2(f.low + push.shift - between, f.high + push.shift + between);
  blocks[first] = uvec4(floatBitsToUint(range), zero, falls ? 1 : 0);
  note_facts(b, f, between, finest + more);
}
