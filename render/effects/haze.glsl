// Air thins out with height: its optical depth over `distance` metres from the eye to a point `rise` metres
// higher; `at_eye` is the depth a metre at the eye's height.
float air_depth(float at_eye, float distance, float rise, float per_height) {
  float x = rise * per_height;
  // (1 - e^-x) / x, by its series where the difference would lose its digits.
  float mean = abs(x) < 0.01 ? 1.0 - x * (0.5 - x / 6.0) : (1.0 - exp(-x)) / x;
  return at_eye * distance * mean;
}

// All the way through the air in a direction whose sine above the horizontal is `up`.
float sky_depth(float at_eye, float up, float per_height) {
  return up > 0.0 ? at_eye / (per_height * max(up, 1e-4)) : 1e4;
}

// Of red, green and blue: short waves are scattered more. Visibility is defined for green.
vec3 transmittance(float depth) { return exp(vec3(0.85, 1.0, 1.2) * -depth); }

vec3 through_air(vec3 light, vec3 air, float depth) {
  vec3 t = transmittance(depth);
  return light * t + air * (vec3(1.0) - t);
}
