// Where a value lies on a scale: 0 at its lowest, 1 at its highest.
float scale_part(float value, float lowest, float highest, bool logarithmic) {
  if (!(highest > lowest)) return 0.3;
  float part = logarithmic ? log(max(value, lowest) / lowest) / log(highest / lowest)
                           : (value - lowest) / (highest - lowest);
  return clamp(part, 0.0, 1.0);
}
