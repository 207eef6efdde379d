// The running composition at one point (blend/batch.cpp: add and finish). Heights are summed as differences to
// the first one, so that float32 keeps what it has of them.

struct Sum {
  real weight, height, bound;     // sums over the patches read so far
  real first, low, high, worst;   // height of the first; least and largest difference; largest error
  real rest, plain, most;         // what later patches share; weight without volumes; largest weight
  vec2_ slope, weight_slope, rest_slope;  // of height, weight and rest, per metre along x and y
  int source;
  uint reads;
};

Sum nothing() {
  return Sum(real(0), real(0), real(0), real(0), real(0), real(0), real(0), real(1), real(0), real(0), vec2_(0),
             vec2_(0), vec2_(0), 0, 0u);
}

// `own`: the patch's weight; `ramp`: what it takes from later ones; `volume`: 1 with priority; `turn`:
// derivatives of u (first column: x, y) and v along x and y.
void add(inout Sum s, Jet own, Jet ramp, real volume, Jet height, real error, int source, mat2_ turn) {
  const vec2_ own_slope = turn * vec2_(own.u, own.v);
  const real w = kPriority ? own.at * s.rest : own.at * volume;
  if (s.reads == 0) s.first = height.at;
  const real d = height.at - s.first;
  s.weight += w, s.height += w * d, s.bound += w * error, s.plain += kPriority ? w : own.at;
  s.low = min(s.low, d), s.high = max(s.high, d), s.worst = max(s.worst, error);
  if (w > s.most) s.most = w, s.source = source;
  ++s.reads;
  if (kGradient) {
    const vec2_ dw = kPriority ? own_slope * s.rest + own.at * s.rest_slope : own_slope * volume;
    s.weight_slope += dw;
    s.slope += dw * d + w * (turn * vec2_(height.u, height.v));
    s.rest_slope = s.rest_slope * (1 - ramp.at) - s.rest * (turn * vec2_(ramp.u, ramp.v));
  }
  if (kPriority) s.rest *= 1 - ramp.at;
}

struct Answer { real height, bound; vec2_ slope; int source; };

Answer finish(Sum s) {
  const real mean = s.height / s.weight;
  return Answer(s.first + clamp(mean, s.low, s.high), min(s.bound / s.weight, s.worst),
                (s.slope - mean * s.weight_slope) / s.weight, s.source);
}

const uint kNan = 0x7fc00000u;

// The answer goes to its planes; withheld where the bound is too large.
void put(uint at, Answer a, bool any) {
  any = any && float(a.bound) <= push.strict_error;
  results[at] = any ? floatBitsToUint(float(a.height)) : kNan;
  if (kBound) results[push.bound_at + at] = any ? floatBitsToUint(float(a.bound)) : kNan;
  if (kSource) results[push.source_at + at] = any ? uint(a.source) : 0u;
  if (kGradient) {
    results[push.gradient_at + 2 * at] = any ? floatBitsToUint(float(a.slope.x)) : kNan;
    results[push.gradient_at + 2 * at + 1] = any ? floatBitsToUint(float(a.slope.y)) : kNan;
  }
}
