// The colour of a pixel, in linear light, from what is known of the ground under it. The includer gives
//     Look look; bool has_sun, has_shadow, ...          which effects are on
//     vec3 tint_color(float t), overlay_color(float t)   ramps over [0, 1], linear light
// and the effects' own files before this one.
struct Ground {
  vec3 from_eye;    // metres, its z after curvature
  float z;          // height, metres
  vec3 normal;      // unit, upward
  float change;     // of the height, from pixel to pixel, metres
  float horizon;    // tangent under which the terrain rises towards the sun
  float open;       // part of the sky's directions that see the sky
  float value;      // of the error or cost overlay
  vec3 source;      // colour of the grid that answers
};

vec3 base_color(Ground g) {
  vec3 base = vec3(look.ground);
  if (has_tints) base = tint_color(clamp((g.z - look.tints.x) * look.tints.y, 0.0, 1.0));
  if (has_scale)
    base = mix(base, overlay_color(scale_part(g.value, look.overlay.x, look.overlay.y, look.overlay.z > 0.5)),
               look.overlay.w);
  if (has_source) base = mix(base, g.source, look.overlay.w);
  if (has_contours) {
    float cover = contour_lines(g.z, g.change, look.contour_lines.x, look.contour_lines.y, look.contour_lines.z);
    base = mix(base, vec3(look.contours), look.contours.w * cover);
  }
  return base;
}

vec3 light_on(Ground g) {
  float open = has_sky ? sky_light(g.open, look.ground.w) : 1.0;
  if (!has_sun) return vec3(open * plain_light(g.normal));
  float reach = 1.0;
  if (has_shadow)
    reach = 1.0 - look.ambient.w * (1.0 - sun_reach(g.horizon, look.sun_direction.w, look.sun_light.w));
  return sun_light(g.normal, vec3(look.sun_direction), vec3(look.sun_light), reach) +
         ambient_light(g.normal, vec3(look.ambient), open);
}

// The sky in a direction, without the sun's disc.
vec3 sky_color(vec3 direction) {
  vec3 color = vec3(look.background);
  if (has_haze) color = through_air(color, vec3(look.air), sky_depth(look.air.w, direction.z, look.air_scale.x));
  if (has_disc)
    color += vec3(look.sun_light) *
             solar_glow(dot(direction, vec3(look.sun_direction)), look.air_scale.z, look.air_scale.w);
  return color;
}

vec3 shade_sky(vec3 direction) {
  vec3 color = sky_color(direction);
  if (has_disc)
    color += vec3(look.sun_light) * 4.0 *
             solar_disc(dot(direction, vec3(look.sun_direction)), look.tints.z, look.view_right.w);
  return color;
}

// The part of the way to the ground that lies in the water, from the surface down.
vec3 water_over(Ground g, vec3 ground) {
  float level = look.water.w - look.air_scale.y, way = length(g.from_eye);
  float rise = g.z - look.water.w;  // below 0; the eye may be below too
  float share = level < 0.0 ? rise / (rise + level) : 1.0;
  vec3 to_ground = g.from_eye / way;
  if (level >= 0.0) return under_water(ground, vec3(look.water), vec3(look.water), way, look.water_surface.y, 0.0);
  vec3 n = vec3(0.0, 0.0, 1.0);
  float away = way * (1.0 - share);
  if (look.water_surface.x > 0.0) {
    vec2 p = vec2(g.from_eye) * (1.0 - share) + vec2(look.water_surface.z, look.water_surface.w);
    float footprint = away * look.view_right.w / max(-to_ground.z, 0.02);
    n = normalize(vec3(-wave_slope(p, look.water_surface.x, footprint), 1.0));
  }
  vec3 mirror = to_ground - 2.0 * dot(to_ground, n) * n;
  mirror.z = abs(mirror.z);
  vec3 mirrored = sky_color(mirror);
  if (has_sun) mirrored += vec3(look.sun_light) * pow(max(dot(mirror, vec3(look.sun_direction)), 0.0), 400.0);
  return under_water(ground, vec3(look.water), mirrored, way * share, look.water_surface.y,
                     water_fresnel(-dot(to_ground, n)));
}

vec3 shade_ground(Ground g) {
  vec3 color = base_color(g) * light_on(g);
  if (has_water && g.z < look.water.w) color = water_over(g, color);
  if (has_haze)
    color = through_air(color, vec3(look.air),
                        air_depth(look.air.w, length(g.from_eye), g.z - look.air_scale.y, look.air_scale.x));
  return color;
}

// Through the point (x, y) of the picture, in pixels.
vec3 direction_through(float x, float y) {
  float right = (x - look.view_up.w) * look.view_right.w, up = (look.view_forward.w - y) * look.view_right.w;
  return normalize(vec3(look.view_forward) + vec3(look.view_right) * right + vec3(look.view_up) * up);
}

// By how much the height changes from pixel to pixel on ground with normal n, seen at from_eye: on its tangent
// plane, so that no edge of a triangle shows.
float height_change(vec3 from_eye, vec3 n) {
  float axial = max(dot(from_eye, vec3(look.view_forward)), 1e-3);
  vec3 d = from_eye / axial;
  float facing = min(dot(n, d), -0.02 * length(d));
  float x = look.view_right.z - d.z * dot(n, vec3(look.view_right)) / facing;
  float y = look.view_up.z - d.z * dot(n, vec3(look.view_up)) / facing;
  return axial * look.view_right.w * length(vec2(x, y));
}

// A fixed pattern of half a step of 8 bits either way: smooth colours do not fall into bands. Source: Jimenez,
// "Next generation post processing in Call of Duty: Advanced Warfare" (2014), interleaved gradient noise.
float dither(float x, float y) {
  return (fract(52.9829189 * fract(0.06711056 * x + 0.00583715 * y)) - 0.5) / 255.0;
}

vec3 srgb(vec3 c) {
  c = clamp(c, vec3(0.0), vec3(1.0));
  vec3 high = 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055;
  return mix(12.92 * c, high, step(vec3(0.0031308), c));
}
