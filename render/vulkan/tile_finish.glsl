// A tile from what the evaluator left on the card: its heights and slopes go to its slot, and each of its 8 x 8 blocks
// is measured, as tile_finish.comp or mesh_finish.comp do. `results` holds the tile at every half cell, with a halo
// of one.

layout(local_size_x = 64) in;  // the blocks of a tile

layout(binding = 0) uniform samplerBuffer results;  // planes: heights, bounds, slopes (pairs)
layout(binding = 1) writeonly buffer Heights { float heights[]; };
layout(binding = 2) writeonly buffer Blocks { uvec4 blocks[]; };  // facts of the blocks of slots
layout(binding = 3, rg16f) writeonly uniform image2DArray slopes;
layout(binding = 4) writeonly buffer Summaries { float summaries[]; };  // kSummary a block
layout(binding = 5) readonly buffer Slots { uint slots[]; };
layout(binding = 6, rg16f) writeonly uniform image2DArray knowledge;    // only with kKnowing: bound, source
layout(binding = 7) uniform isamplerBuffer words;                       // the results as whole numbers
layout(binding = 8) readonly buffer Lacks { vec2 lacks[]; };  // of blocks: TilePatches::Block
layout(constant_id = 0) const bool kKnowing = false;
layout(push_constant) uniform Push {
  uint bound_at, slope_at;  // where planes begin
  float shift;              // metres: from the evaluator's base to the slots'
  float between;            // of the largest second differences: what the surface may do between samples
  uint source_at;
} push;

const int kVertices = 65, kSide = 131, kBlockSamples = 16, kSummary = 5;
#define kNothing uintBitsToFloat(0x7f800000u)

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
  bool holes;
};

// Second differences at a sample of a block, counted from the block's corner.
void note_bend(int base, ivec2 block, ivec2 at, vec2 bend);

BlockFacts facts_of(int base, int bound_base, int b) {
  BlockFacts f = BlockFacts(kNothing, -kNothing, 0, vec2(0), false);
  const ivec2 block = ivec2(b % 8, b / 8) * kBlockSamples;
  if (lacks[gl_WorkGroupID.x * 64 + b].x < 0) return f;  // at most its border has heights
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
      const vec2 bend = vec2(isnan(x) ? 0 : x, isnan(y) ? 0 : y);
      f.bend = max(f.bend, bend);
      note_bend(base, block, ivec2(c, r), bend);
    }
  return f;
}

// What a block may be off because of its patches, not of its mesh.
float reducible(int b, float bound) {
  const vec2 lack = lacks[gl_WorkGroupID.x * 64 + b];
  return max(0, lack.x) + max(0, bound - lack.y);
}

// `error`: of the block with all its vertices, where it has data; `lack`: reducible().
void note_facts(int b, BlockFacts f, float between, float error, float lack) {
  const uint first = (gl_WorkGroupID.x * 64 + b) * kSummary;
  summaries[first] = f.low - between, summaries[first + 1] = f.high + between;
  summaries[first + 2] = lack + error, summaries[first + 3] = f.bound, summaries[first + 4] = f.holes ? 1 : 0;
}

// Bit s: some sample of side s has no data.
uint holes_along(int base, ivec2 block) {
  uint sides = 0;
  for (int s = 0; s < 4; ++s)
    for (int k = 0; k <= kBlockSamples; ++k) {
      const int across = (s & 1) * kBlockSamples;
      sides |= isnan(height_at(base, block + (s < 2 ? ivec2(across, k) : ivec2(k, across)))) ? 1u << s : 0;
    }
  return sides;
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
}
