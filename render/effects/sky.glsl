// Directions of equal weight for level ground: the cosine's hemisphere by Vogel's spiral. Direction i of k:
// xy unit in the plane, z the tangent of its elevation.
vec3 sky_direction(int i, int k) {
  float r = sqrt((float(i) + 0.5) / float(k)), azimuth = 2.399963229728653 * float(i);
  return vec3(cos(azimuth), sin(azimuth), sqrt(1.0 - r * r) / r);
}

// The lowest direction's tangent: terrain that stays below it takes no bit.
float lowest_sky_direction(int k) { return sky_direction(k - 1, k).z; }

// What is left of the light from everywhere where a part `open` of the directions sees the sky.
float sky_light(float open, float strength) { return 1.0 - strength * (1.0 - open); }
