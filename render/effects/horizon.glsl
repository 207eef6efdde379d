// The steepest tangent under which a raster of heights is seen from a place, by its pyramid of largest heights.
// The includer gives:
//     float height_at(int i, int j)        metres, sample (i, j); the surface between samples is bilinear
//     float pyramid_max(int l, int i, int j)   largest height of cells [i, i + 1) 2^l x [j, j + 1) 2^l
//     int width, height, top                samples a side, the pyramid's last level
// Cell (i, j) lies between samples (i, j) and (i + 1, j + 1). A block whose highest point, seen from where the
// ray enters it, lies below what was found is left out whole; the rest is opened down to cells, whose own
// steepest tangent is exact. CAVEAT: heights that are not numbers must be low numbers instead.

// Where a ray from p in direction d leaves the square [low, low + side).
float exit_of(vec2 p, vec2 d, vec2 low, float side) {
  float x = d.x > 0.0 ? (low.x + side - p.x) / d.x : d.x < 0.0 ? (low.x - p.x) / d.x : 1e30;
  float y = d.y > 0.0 ? (low.y + side - p.y) / d.y : d.y < 0.0 ? (low.y - p.y) / d.y : 1e30;
  return min(x, y);
}

// The largest (h(t) - z) / t over [t0, t1] in cell (i, j): h is a parabola a + b t + c t^2 along the ray.
float steepest_in_cell(vec2 p, vec2 d, float z, int i, int j, float t0, float t1) {
  float h00 = height_at(i, j), h10 = height_at(i + 1, j);
  float h01 = height_at(i, j + 1), h11 = height_at(i + 1, j + 1);
  float x = p.x - float(i), y = p.y - float(j), u = h10 - h00, v = h01 - h00, w = h11 - h10 - h01 + h00;
  float a = h00 + u * x + v * y + w * x * y - z, b = u * d.x + v * d.y + w * (x * d.y + y * d.x);
  float c = w * d.x * d.y;
  float best = max(a / t0 + b + c * t0, a / t1 + b + c * t1);
  // a / t + b + c t has its largest value at t = sqrt(a / c), where both are below 0.
  float t = c < 0.0 && a < 0.0 ? sqrt(a / c) : 0.0;
  return t > t0 && t < t1 ? max(best, a / t + b + c * t) : best;
}

// From `p` (samples) at height z, in the unit direction d; distances are counted in samples, from `first` on, so
// divide by a sample's metres. Stops when `enough` is reached.
float horizon(vec2 p, vec2 d, float z, float first, float enough) {
  float best = -1e30, t = first;
  int level = 0;
  // Every round passes a block or opens one: more rounds than this are none.
  for (int n = 0; n < 8 * (width + height) + 64 && best < enough; ++n) {
    vec2 q = p + d * t;
    int i = int(floor(q.x)), j = int(floor(q.y));
    if (i < 0 || j < 0 || i >= width - 1 || j >= height - 1) break;
    float side = float(1 << level);
    int bi = i >> level, bj = j >> level;
    float t1 = max(exit_of(p, d, vec2(float(bi), float(bj)) * side, side), t);
    float rise = pyramid_max(level, bi, bj) - z;
    // A rise is steepest seen from near, a fall from far.
    if (rise > best * (rise > 0.0 ? t : t1)) {
      if (level > 0) {
        level -= 1;
        continue;
      }
      best = max(best, steepest_in_cell(p, d, z, i, j, t, max(t1, t + 1e-4)));
    }
    t = t1 + 1e-3;
    if (level < top) level += 1;
  }
  return best;
}
