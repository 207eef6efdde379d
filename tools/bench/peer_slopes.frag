#version 450
layout(location = 0) in vec3 local;
layout(location = 0) out vec4 color;
layout(binding = 3) uniform sampler2DArray slopes;
void main() {
  const vec2 slope = texture(slopes, vec3((local.xy * 128.0 + 0.5) / 129.0, local.z)).xy;
  const float light =
      0.25 + 0.75 * max(dot(normalize(vec3(-slope, 1)), normalize(vec3(-0.5, 0.5, 0.7))), 0.0);
  color = vec4(vec3(0.78, 0.76, 0.7) * light, 1);
}
