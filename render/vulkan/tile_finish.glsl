// A tile from what the evaluator left on the card: its heights and slopes go to its slot, and each of its 8 x 8 blocks
// is measured, as tile_finish.comp or mesh_finish.comp do. `results` holds the tile at every half cell, with a halo
// of one.

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 0) uniform samplerBuffer results;  // planes: heights, bounds, slopes (pairs)
layout(binding = 1) writeonly buffer Heights { float heights[]; };
layout(binding = 2) writeonly buffer Blocks { uvec4 blocks[]; };  // facts of the blocks of slots
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

// Of a block: its extremes and largest bound where there are heights; its largest second differences.
struct BlockFacts {
  float low, high, bound;
  vec2 bend;
  float twist;  // only with kTwisting: what bends squares of half cells from their corners' planes
  bool holes;
};

float twist_of(int base, ivec2 at, float here) {
  const float beside = height_at(base, at + ivec2(1, 0)), above = height_at(base, at + ivec2(0, 1));
  const float t = abs(here - beside - above + height_at(base, at + 1));
  return isnan(t) ? 0 : t;
}

BlockFacts facts_of(int base, int bound_base, ivec2 block) {
  BlockFacts f = BlockFacts(kNothing, -kNothing, 0, vec2(0), 0, false);
  for (int r = 0; r <= kBlockSamples; ++r)
    for (int c = 0; c <= kBlockSamples; ++c) {
      const ivec2 at = block + ivec2(c, r);
      const float h = height_at(base, at);
      if (isnan(h)) {
        f.holes = true;
        continue;
      }
      f.low = min(f.low, h), f.high = max(f.high, h);
      f.bound = max(f.bound, texelFetch(results, bound_base + (at.y + 1) * kSide + at.x + 1).x);
      const float x = second_difference(base, at, ivec2(1, 0), h), y = second_difference(base, at, ivec2(0, 1), h);
      f.bend = max(f.bend, vec2(isnan(x) ? 0 : x, isnan(y) ? 0 : y));
      if (kTwisting && r < kBlockSamples && c < kBlockSamples) f.twist = max(f.twist, twist_of(base, at, h));
    }
  return f;
}

// `error`: of the block with all its vertices, where it has no holes.
void note_facts(int b, BlockFacts f, float between, float error) {
  tile_facts[b][0] = f.low - between, tile_facts[b][1] = f.high + between;
  tile_facts[b][2] = f.holes ? 0 : error, tile_facts[b][3] = f.bound;
  tile_facts[b][4] = f.holes ? 1 : 0, tile_facts[b][5] = f.low <= f.high ? 1 : 0;
}

void measure(int base, int bound_base, int slot, int b);

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
