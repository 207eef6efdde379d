// Schlick's approximation for water.
float water_fresnel(float c) { return 0.02 + 0.98 * pow(1.0 - clamp(c, 0.0, 1.0), 5.0); }

// Slope of the waves at `p` metres (modulo wave_period): each wave's vector is a whole part of the period, so that
// eyes may be anywhere. Waves shorter than two pixels are left out; `footprint` is a pixel's metres.
float wave_period(float waves) { return 240.0 * waves; }
vec2 wave(vec2 p, vec2 turns, float period, float steepness, float footprint) {
  float shortest = period / length(turns);
  float seen = smoothstep(2.0 * footprint, 6.0 * footprint, shortest);
  return normalize(turns) * (steepness * seen * cos(dot(p, turns) * (6.283185307179586 / period)));
}
vec2 wave_slope(vec2 p, float waves, float footprint) {
  float period = wave_period(waves);
  vec2 s = wave(p, vec2(7.0, 3.0), period, 0.05, footprint);
  s += wave(p, vec2(5.0, -8.0), period, 0.045, footprint);
  s += wave(p, vec2(-13.0, 9.0), period, 0.04, footprint);
  s += wave(p, vec2(17.0, 15.0), period, 0.035, footprint);
  s += wave(p, vec2(3.0, 31.0), period, 0.03, footprint);
  return s + wave(p, vec2(41.0, -11.0), period, 0.025, footprint);
}

// Ground seen through `path` metres of water, below a surface that reflects `mirrored`.
vec3 under_water(vec3 ground, vec3 deep, vec3 mirrored, float path, float per_metre, float fresnel) {
  return mix(mix(deep, ground, exp(-path * per_metre)), mirrored, fresnel);
}
