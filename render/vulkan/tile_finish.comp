#version 450
// A tile whose blocks are tessellated: a block's errors are those of every 2nd, 4th and 8th vertex.
#extension GL_GOOGLE_include_directive : require
#include "tile_finish.glsl"

layout(constant_id = 1) const bool kPublished = false;

// Over a cell of `size` half cells: the span of what is left of the surface when a plane is taken away. No
// triangle with its vertices on the surface and inside the cell is farther from the surface than that: both
// are within [least, most] of the plane. 0 where there are holes.
float span(int base, ivec2 from, int size) {
  const float a = height_at(base, from), b = height_at(base, from + ivec2(size, 0));
  const float c = height_at(base, from + ivec2(0, size)), d = height_at(base, from + ivec2(size));
  const vec2 slope = vec2((b - a) + (d - c), (c - a) + (d - b)) / float(2 * size);
  float least = kNothing, most = -kNothing;
  bool holes = false;
  for (int r = 0; r <= size; ++r)
    for (int k = 0; k <= size; ++k) {
      const float h = height_at(base, from + ivec2(k, r)) - a - dot(slope, vec2(k, r));
      holes = holes || isnan(h);
      least = min(least, h), most = max(most, h);
    }
  return holes ? 0 : most - least;
}

float largest_span(int base, ivec2 block, int size) {
  float worst = 0;
  for (int r = 0; r < kBlockSamples; r += size)
    for (int c = 0; c < kBlockSamples; c += size) worst = max(worst, span(base, block + ivec2(c, r), size));
  return worst;
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

void note_bend(int base, ivec2 block, ivec2 at, vec2 bend) {}

void measure(int base, int bound_base, int slot, int b) {
  const ivec2 block = ivec2(b % 8, b / 8) * kBlockSamples;
  const BlockFacts f = facts_of(base, bound_base, b);
  const float between = push.between * (f.bend.x + f.bend.y);
  const float finest = between + largest_span(base, block, 2);
  vec4 error = vec4(kNothing);
  const float lack = reducible(b, f.bound);
  vec3 own = vec3(kNothing);
  if (!f.holes) {
    for (int d = 0; kPublished && d < 3; ++d) own[d] = published(base, block, 4 << d);
    error.x = finest;
    for (int d = 1; d < 4; ++d) error[d] = between + largest_span(base, block, 2 << d);
    for (int d = 1; d < 4; ++d) error[d] = max(error[d], error[d - 1]);
  }
  const vec2 range = vec2(f.low + push.shift - between, f.high + push.shift + between);
  const uvec3 last = kPublished ? floatBitsToUint(own) : uvec3(floatBitsToUint(lack), holes_along(base, block), 0);
  blocks[(slot * 64 + b) * 2] = uvec4(floatBitsToUint(error.yzw), last.x);
  blocks[(slot * 64 + b) * 2 + 1] = uvec4(floatBitsToUint(range), last.yz);
  note_facts(b, f, between, finest, lack);
}
