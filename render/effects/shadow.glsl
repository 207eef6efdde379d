// The part of the sun's disc above the terrain: `horizon` is the tangent of the angle under which the terrain
// rises towards the sun; the edge fades over 2 * half_angle.
float sun_reach(float horizon, float tan_elevation, float half_angle) {
  float above = atan(tan_elevation) - atan(horizon);
  return half_angle > 0.0 ? smoothstep(-half_angle, half_angle, above) : (above > 0.0 ? 1.0 : 0.0);
}
