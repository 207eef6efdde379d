#version 450
layout(location = 0) in vec3 normal;
layout(location = 0) out vec4 color;
void main() {
  const float light = 0.25 + 0.75 * max(dot(normalize(normal), normalize(vec3(-0.5, 0.5, 0.7))), 0.0);
  color = vec4(vec3(0.78, 0.76, 0.7) * light, 1);
}
