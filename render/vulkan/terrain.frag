#version 450
// A pixel of the terrain: what is known of the ground there, then shade.glsl.
#extension GL_GOOGLE_include_directive : require
#include "terrain.glsl"
#include "effects.glsl"

layout(location = 0) in vec4 local;  // terrain.glsl: Vertex
layout(location = 0) out vec4 color;
layout(binding = 4) uniform sampler2DArray slopes;  // dh/dx, dh/dy at half cells

layout(constant_id = 0) const bool kHoles = false;

Ground ground_here() {
  Ground g;
  const vec3 place = place_at(gl_FragCoord);
  g.from_eye = place;
  g.z = place.z + look.air_scale.y + frame.detail.y * dot(place.xy, place.xy);
  g.normal = normalize(vec3(-texture(slopes, local.xyw).xy, 1));
  g.change = has_contours ? height_change(place, g.normal) : 0.0;
  const vec2 at = look.light_map.xy + place.xy * look.light_map.z;
  g.horizon = has_shadow ? texture(sun_map, (at + 0.5) / vec2(textureSize(sun_map, 0))).x : 0.0;
  g.open = has_sky ? texture(sky_map, (0.25 * at + 0.5) / vec2(textureSize(sky_map, 0))).x : 1.0;
  g.value = has_cost ? patches_of(int(local.z + 0.5)) : has_scale ? texture(knowledge, local.xyw).x : 0.0;
  g.source = vec3(0);
  if (has_source) g.source = class_color(int(texelFetch(knowledge, ivec3(local.xy * vec2(textureSize(knowledge, 0)), int(local.w + 0.5)), 0).y));
  return g;
}

void main() {
  if (kHoles && local.z < -0.5) discard;
  if (is_plain) {
    const vec3 n = normalize(vec3(-texture(slopes, local.xyw).xy, 1));
    color = vec4(vec3(0.78, 0.76, 0.7) * (0.25 + 0.75 * max(dot(n, normalize(vec3(-0.5, 0.5, 0.7))), 0.0)), 1);
    return;
  }
  vec3 light = shade_ground(ground_here());
  if (is_wireframe) light = mix(light, look.wireframe.rgb, look.wireframe.w);
  color = picture_color(light);
}
