#version 450
// How far blocks of 8 x 8 cells of a tile depart from the blend when only every 2nd, 4th, 8th vertex is kept.
// `results` holds the tile's heights and bounds `push.fine` times as dense as its vertices; a work group has a tile.
#define real float
#define vec2_ vec2
#define vec3_ vec3
#define vec4_ vec4
#define mat2_ mat2
#define RESULTS
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(local_size_x = 64) in;

const uint kCells = 8;

shared uint tile_bound;  // bits of a float

float height_at(uvec2 at, uint plane) {
  return uintBitsToFloat(results[plane + at.y * push.side + at.x]);
}

// Distance from both triangulations of a cell with corners a b / c d, whichever diagonal will be drawn.
float off_triangles(float h, vec4 corner, vec2 t) {
  const float a = corner.x, b = corner.y, c = corner.z, d = corner.w;
  const float falling = t.x >= t.y ? a + t.x * (b - a) + t.y * (d - b) : a + t.y * (c - a) + t.x * (d - c);
  const float rising = t.x + t.y <= 1 ? a + t.x * (b - a) + t.y * (c - a)
                                      : d + (1 - t.x) * (c - d) + (1 - t.y) * (b - d);
  return max(abs(h - falling), abs(h - rising));
}

// Over the simplified cell at `from`, `size` samples along each side; infinity where something has no data.
float cell_error(uvec2 from, uint size, uint plane) {
  const vec4 corner = vec4(height_at(from, plane), height_at(from + uvec2(size, 0), plane),
                           height_at(from + uvec2(0, size), plane), height_at(from + uvec2(size), plane));
  float worst = 0;
  for (uint r = 0; r <= size; ++r)
    for (uint c = 0; c <= size; ++c) {
      const float off = off_triangles(height_at(from + uvec2(c, r), plane), corner, vec2(c, r) / float(size));
      worst = off <= worst ? worst : off;  // takes NaN
      if (isnan(off)) return uintBitsToFloat(0x7f800000u);
    }
  return worst;
}

float second_difference(uvec2 at, uvec2 step, uint plane) {
  return abs(height_at(at - step, plane) - 2 * height_at(at, plane) + height_at(at + step, plane));
}

// What the blend may do between the samples: half of the largest second differences, which is a kink's height over
// its chord, and four times that of a curve.
float between(uvec2 from, uint size, uint plane) {
  float across = 0, down = 0;
  for (uint r = 0; r <= size; ++r)
    for (uint c = 1; c < size; ++c) {
      const uvec2 i = from + uvec2(c, r), j = from + uvec2(r, c);
      across = max(across, second_difference(i, uvec2(1, 0), plane));
      down = max(down, second_difference(j, uvec2(0, 1), plane));
    }
  return 0.5 * (across + down);
}

float largest_bound(uvec2 from, uint size, uint plane) {
  float worst = 0;
  for (uint r = 0; r <= size; ++r)
    for (uint c = 0; c <= size; ++c) worst = max(worst, height_at(from + uvec2(c, r), plane));
  return worst;
}

void main() {
  const uint tile = gl_WorkGroupID.x, a_tile = push.side * push.side;
  const uint block_samples = kCells * push.fine, across = (push.side - 1) / block_samples;
  if (gl_LocalInvocationID.x == 0) tile_bound = 0;
  barrier();
  for (uint b = gl_LocalInvocationID.x; b < across * across; b += 64) {
    const uvec2 from = uvec2(b % across, b / across) * block_samples;
    atomicMax(tile_bound, floatBitsToUint(largest_bound(from, block_samples, push.bound_at + tile * a_tile)));
  }
  barrier();
  const float bound = uintBitsToFloat(tile_bound);
  for (uint b = gl_LocalInvocationID.x; b < across * across; b += 64) {
    const uvec2 from = uvec2(b % across, b / across) * block_samples;
    const float extra = between(from, block_samples, tile * a_tile) + bound;
    float worst = 0;
    for (uint d = 1; d <= 3; ++d) {
      const uint size = push.fine << d;
      for (uint r = 0; r < block_samples; r += size)
        for (uint c = 0; c < block_samples; c += size)
          worst = max(worst, cell_error(from + uvec2(c, r), size, tile * a_tile));
      results[push.errors_at + (tile * across * across + b) * 3 + d - 1] = floatBitsToUint(worst + extra);
    }
  }
}
