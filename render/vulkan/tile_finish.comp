#version 450
// A tile from what the evaluator left on the card: its heights and slopes go to its slot, and each of its 8 x 8 blocks
// is measured. `results` holds the tile at every half cell, with a halo of one.
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 0) uniform samplerBuffer results;  // planes: heights, bounds, slopes (pairs)
layout(binding = 1) writeonly buffer Heights { float heights[]; };
layout(binding = 2) writeonly buffer Blocks { uvec4 blocks[]; };  // kBlock a block
layout(binding = 3, rg16f) writeonly uniform image2DArray slopes;
layout(binding = 4) writeonly buffer Summaries { float summaries[]; };  // kSummary a tile
layout(binding = 5) readonly buffer Slots { uint slots[]; };
layout(binding = 6, rg16f) writeonly uniform image2DArray knowledge;    // only with kKnowing: bound, source
layout(binding = 7) uniform isamplerBuffer words;                       // the results as whole numbers
layout(constant_id = 0) const bool kKnowing = false;
layout(constant_id = 1) const bool kPublished = false;
layout(push_constant) uniform Push {
  uint bound_at, slope_at;  // where planes begin
  float shift;              // metres: from the evaluator's base to the slots'
  float between;            // of the largest second differences: what the surface may do between samples
  uint source_at;
} push;

const int kVertices = 65, kSide = 131, kBlockSamples = 16, kSummary = 8;
const int kBlock = 8, kCodeShift = 19;  // terrain.glsl
#define kNothing uintBitsToFloat(0x7f800000u)

shared float tile_facts[64][6];

int first_of(int tile) { return tile * kSide * kSide; }
// Half cell (c, r) of the tile.
float height_at(int base, ivec2 at) {
  return texelFetch(results, base + (at.y + 1) * kSide + at.x + 1).x;
}

float second_difference(int base, ivec2 at, ivec2 step, float here) {
  return abs(height_at(base, at - step) - 2 * here + height_at(base, at + step));
}

// What bends a square of half cells from its corners' plane.
float twist_of(int base, ivec2 at, float here) {
  const float beside = height_at(base, at + ivec2(1, 0)), above = height_at(base, at + ivec2(0, 1));
  const float t = abs(here - beside - above + height_at(base, at + 1));
  return isnan(t) ? 0 : t;
}

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

// As published (Yusov and Shevtsov, section 5): the tile's own vertices against the triangles of a simplified cell.
float published(int base, ivec2 block, int size) {
  float worst = 0;
  for (int r = 0; r < kBlockSamples; r += size)
    for (int c = 0; c < kBlockSamples; c += size) {
      const ivec2 from = block + ivec2(c, r);
      const float a = height_at(base, from), b = height_at(base, from + ivec2(size, 0));
      const float d = height_at(base, from + ivec2(0, size)), e = height_at(base, from + ivec2(size));
      for (int y = 0; y <= size; y += 2)
        for (int x = 0; x <= size; x += 2) {
          const vec2 t = vec2(x, y) / float(size);
          const float h = t.x >= t.y ? a + t.x * (b - a) + t.y * (e - b) : a + t.y * (d - a) + t.x * (e - d);
          worst = max(worst, abs(height_at(base, from + ivec2(x, y)) - h));
        }
    }
  return worst;
}

void measure(int base, int bound_base, int slot, int b) {
  const ivec2 block = ivec2(b % 8, b / 8) * kBlockSamples;
  float low = kNothing, high = -kNothing, bound = 0;
  vec2 bend = vec2(0);
  float twist = 0;
  bool holes = false;
  for (int r = 0; r <= kBlockSamples; ++r)
    for (int c = 0; c <= kBlockSamples; ++c) {
      const ivec2 at = block + ivec2(c, r);
      const float h = height_at(base, at);
      if (isnan(h)) {
        holes = true;
        continue;
      }
      low = min(low, h), high = max(high, h);
      bound = max(bound, texelFetch(results, bound_base + (at.y + 1) * kSide + at.x + 1).x);
      const float x = second_difference(base, at, ivec2(1, 0), h), y = second_difference(base, at, ivec2(0, 1), h);
      bend = max(bend, vec2(isnan(x) ? 0 : x, isnan(y) ? 0 : y));
      if (r < kBlockSamples && c < kBlockSamples) twist = max(twist, twist_of(base, at, h));
    }
  const float between = push.between * (bend.x + bend.y);
  // Sides of triangles halve the squares between samples, too.
  const float more = between + 0.25 * twist;
  for (int k = 0; k < 81; ++k) worst[k] = 0;
  finest = 0, falls = false;
  vec3 own = vec3(kNothing);
  if (!holes) {
    for (int d = 0; kPublished && d < 3; ++d) own[d] = published(base, block, 4 << d);
    const ivec2 here = ivec2(b % 8, b / 8);
    for (int size = kBlockSamples; size >= 2; size /= 2) {
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
    close_errors();
  }
  const int first = (slot * 64 + b) * kBlock;
  const int zero = write_codes(first + 2, more, holes);
  const vec2 range = vec2(low + push.shift - between, high + push.shift + between);
  blocks[first] = uvec4(floatBitsToUint(range), zero, falls ? 1 : 0);
  blocks[first + 1] = uvec4(floatBitsToUint(own), 0);
  tile_facts[b][0] = low - between, tile_facts[b][1] = high + between;
  tile_facts[b][2] = holes ? 0 : finest + more, tile_facts[b][3] = bound;
  tile_facts[b][4] = holes ? 1 : 0, tile_facts[b][5] = low <= high ? 1 : 0;
}

void main() {
  const int tile = int(gl_WorkGroupID.x), lane = int(gl_LocalInvocationID.x), slot = int(slots[tile]);
  const int base = first_of(tile), bound_base = int(push.bound_at) + base;
  measure(base, bound_base, slot, lane);
  for (int k = lane; k < kVertices * kVertices; k += 64)
    heights[slot * kVertices * kVertices + k] =
        height_at(base, 2 * ivec2(k % kVertices, k / kVertices)) + push.shift;
  const int slope_base = int(push.slope_at) + 2 * base;
  for (int k = lane; k < 129 * 129; k += 64) {
    const ivec2 at = ivec2(k % 129, k / 129);
    const int texel = slope_base + 2 * ((at.y + 1) * kSide + at.x + 1);
    const vec2 s = vec2(texelFetch(results, texel).x, texelFetch(results, texel + 1).x);
    imageStore(slopes, ivec3(at, slot), vec4(isnan(s.x + s.y) ? vec2(0) : s, 0, 0));
  }
  for (int k = lane; kKnowing && k < 129 * 129; k += 64) {
    const ivec2 at = ivec2(k % 129, k / 129);
    const int texel = base + (at.y + 1) * kSide + at.x + 1;
    const float bound = texelFetch(results, int(push.bound_at) + texel).x;
    const int source = texelFetch(words, int(push.source_at) + texel).x;
    imageStore(knowledge, ivec3(at, slot), vec4(isnan(bound) ? 0 : bound, source, 0, 0));
  }
  barrier();
  if (lane < 6) {
    float f = tile_facts[0][lane];
    for (int k = 1; k < 64; ++k) f = lane == 0 ? min(f, tile_facts[k][lane]) : max(f, tile_facts[k][lane]);
    summaries[tile * kSummary + lane] = f;
  }
}
