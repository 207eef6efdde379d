// How much of a pixel contour lines cover; `change` is the height's change from pixel to pixel. Where lines
// would reach a quarter of the interval they fade away, so that ground farther than that from a line has none.
float contour_lines(float z, float change, float interval, float bold_every, float width) {
  float nearest = floor(z / interval + 0.5);
  bool bold = bold_every > 0.0 && abs(nearest - bold_every * floor(nearest / bold_every + 0.5)) < 0.5;
  float half_width = (bold ? 1.0 : 0.5) * width * change;
  float reach = half_width + 0.5 * change, away = abs(z - nearest * interval);
  float cover = clamp((reach - away) / max(change, 1e-6), 0.0, 1.0);
  return cover * (1.0 - smoothstep(0.125, 0.25, reach / interval));
}
