#version 450
// A tile from what the evaluator left on the card: its heights and slopes go to its slot, and each of its 8 x 8 blocks
// is measured. `results` holds the tile at every half cell, with a halo of one.
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 0) uniform samplerBuffer results;  // planes: heights, bounds, slopes (pairs)
layout(binding = 1) writeonly buffer Heights { float heights[]; };
layout(binding = 2) writeonly buffer Blocks { vec4 blocks[]; };
layout(binding = 3, rg16f) writeonly uniform image2DArray slopes;
layout(binding = 4) writeonly buffer Summaries { float summaries[]; };  // kSummary a tile
layout(binding = 5) readonly buffer Slots { uint slots[]; };
layout(binding = 6, rg16f) writeonly uniform image2DArray knowledge;    // only with kKnowing: bound, source
layout(binding = 7) uniform isamplerBuffer words;                       // the results as whole numbers
layout(constant_id = 0) const bool kKnowing = false;
layout(push_constant) uniform Push {
  uint bound_at, slope_at;  // where planes begin
  float shift;              // metres: from the evaluator's base to the slots'
  float between;            // of the largest second differences: what the surface may do between samples
  uint source_at;
} push;

const int kVertices = 65, kSide = 131, kBlockSamples = 16, kSummary = 8;
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

// Over a cell of `size` half cells: the span of what is left of the surface when a plane is taken away. No
// triangle with its vertices on the surface and inside the cell is farther from the surface than that: both
// are within [least, most] of the plane.
float span(int base, ivec2 from, int size) {
  const float a = height_at(base, from), b = height_at(base, from + ivec2(size, 0));
  const float c = height_at(base, from + ivec2(0, size)), d = height_at(base, from + ivec2(size));
  const vec2 slope = vec2((b - a) + (d - c), (c - a) + (d - b)) / float(2 * size);
  float least = kNothing, most = -kNothing;
  for (int r = 0; r <= size; ++r)
    for (int k = 0; k <= size; ++k) {
      const float h = height_at(base, from + ivec2(k, r)) - a - dot(slope, vec2(k, r));
      least = min(least, h), most = max(most, h);
    }
  return most - least;
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

void measure(int base, int bound_base, int slot, int b) {
  const ivec2 block = ivec2(b % 8, b / 8) * kBlockSamples;
  float low = kNothing, high = -kNothing, bound = 0;
  vec2 bend = vec2(0);
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
    }
  const float between = push.between * (bend.x + bend.y);
  vec4 error = vec4(kNothing);
  vec3 own = vec3(kNothing);
  if (!holes) {
    for (int d = 0; d < 3; ++d) own[d] = published(base, block, 4 << d);
    for (int d = 0; d < 4; ++d) error[d] = between + largest_span(base, block, 2 << d);
    for (int d = 1; d < 4; ++d) error[d] = max(error[d], error[d - 1]);
  }
  blocks[(slot * 64 + b) * 2] = vec4(error.yzw, own.x);
  blocks[(slot * 64 + b) * 2 + 1] = vec4(low + push.shift - between, high + push.shift + between, own.yz);
  tile_facts[b][0] = low - between, tile_facts[b][1] = high + between;
  tile_facts[b][2] = holes ? 0 : error.x, tile_facts[b][3] = bound;
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
