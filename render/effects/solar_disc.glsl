// Brightness of the sun's disc and of the air around it in a direction whose cosine to the sun is `c`; the
// disc's edge fades over a pixel; the glow ends at 1 / glow_scale radians.
float solar_disc(float c, float cos_radius, float pixel) {
  float angle = acos(clamp(c, -1.0, 1.0)), radius = acos(cos_radius);
  return 1.0 - smoothstep(radius - 0.5 * pixel, radius + 0.5 * pixel, angle);
}
float solar_glow(float c, float glow, float glow_scale) {
  float rest = max(0.0, 1.0 - acos(clamp(c, -1.0, 1.0)) * glow_scale);
  return glow * rest * rest * rest;
}
