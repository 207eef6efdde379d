// Patches with cells that hold no data: blend/batch.cpp has the same on the CPU. A word of a vertex holds
// answering (bit 0) and real (bit 1) of the cell that starts there, its `near` (bits 8-15) and `wide` (16-23).

uint word_at(int slot, int i, int j) { return texelFetch(words, slot * kSamples + j * kSide + i).x; }

// Bits of the closed cells at a place: on an edge or a corner any of the cells that share it will do.
uint cell_bits(int slot, Place u, Place v) {
  const int i = cell_at(u), j = cell_at(v);
  const real s = beyond(u, real(i)), t = beyond(v, real(j));
  const int i0 = s <= kOnEdge ? i - 1 : i, i1 = 1 - s <= kOnEdge ? i + 1 : i;
  const int j0 = t <= kOnEdge ? j - 1 : j, j1 = 1 - t <= kOnEdge ? j + 1 : j;
  uint bits = 0;
  for (int b = j0; b <= j1; ++b)
    for (int a = i0; a <= i1; ++a) bits |= word_at(slot, a, b);
  return bits & 3u;
}

real near_at(int slot, int i, int j) { return real(word_at(slot, i, j) >> 8 & 255u); }

// The uniform cubic B-spline and its derivative; .z is the sum of the coefficients.
vec3_ spline(real a, real b, real c, real d, real t) {
  const real s = 1 - t;
  return vec3_((s * s * s * a + (4 + t * t * (3 * t - 6)) * b + (4 + s * s * (3 * s - 6)) * c + t * t * t * d) / 6,
               (-s * s * a + t * (3 * t - 4) * b - s * (3 * s - 4) * c + t * t * d) / 2, a + b + c + d);
}

// The wide distances of the four vertices around a cell in row j.
vec3_ spline_row(int slot, int i, int j, real s) {
  vec4_ d;
  for (int a = 0; a < 4; ++a) d[a] = real(word_at(slot, i - 1 + a, j) >> 16 & 255u);
  return spline(d.x, d.y, d.z, d.w, s);
}

// 1 a feather away from cells without data, 0 on them.
Jet hole_factor(int slot, Place u, Place v) {
  const int i = cell_at(u), j = cell_at(v);
  const real s = beyond(u, real(i)), t = beyond(v, real(j));
  if (kSmoothness == 0) {
    const real a = near_at(slot, i, j), b = near_at(slot, i + 1, j);
    const real c = near_at(slot, i, j + 1), d = near_at(slot, i + 1, j + 1);
    const real low = a + s * (b - a), high = c + s * (d - c);
    return Jet((low + t * (high - low)) / kHoleFeather, ((b - a) + t * ((d - c) - (b - a))) / kHoleFeather,
               (high - low) / kHoleFeather);
  }
  const vec3_ a = spline_row(slot, i, j - 1, s), b = spline_row(slot, i, j, s);
  const vec3_ c = spline_row(slot, i, j + 1, s), d = spline_row(slot, i, j + 2, s);
  if (a.z + b.z + c.z + d.z == 16 * kHoleFeather) return Jet(real(1), real(0), real(0));
  const vec3_ along = spline(a.x, b.x, c.x, d.x, t), across = spline(a.y, b.y, c.y, d.y, t);
  return Jet(clamp(along.x / kHoleFeather, real(0), real(1)), across.x / kHoleFeather, along.y / kHoleFeather);
}

// The product rule.
Jet times(Jet a, Jet b) { return Jet(a.at * b.at, a.u * b.at + a.at * b.u, a.v * b.at + a.at * b.v); }
