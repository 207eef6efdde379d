// Sun light on ground of unit normal n; `reach` is the part of the sun that the place sees.
vec3 sun_light(vec3 n, vec3 to_sun, vec3 light, float reach) { return light * (reach * max(dot(n, to_sun), 0.0)); }

// Light from everywhere: all of it on level ground that sees all of the sky.
vec3 ambient_light(vec3 n, vec3 light, float open) { return light * (open * (0.5 + 0.5 * n.z)); }

// Without a sun: relief from the north-west, 1 on level ground.
float plain_light(vec3 n) { return 0.4 + 0.6 / 0.7035 * max(dot(n, vec3(-0.5025, 0.5025, 0.7035)), 0.0); }
