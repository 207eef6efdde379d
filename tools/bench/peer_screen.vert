#version 450
// One triangle over the whole picture.
layout(location = 0) out vec3 local;
void main() {
  const vec2 at = vec2(gl_VertexIndex == 1 ? 3 : -1, gl_VertexIndex == 2 ? 3 : -1);
  local = vec3(0.5 + 0.5 * at, 0);
  gl_Position = vec4(at, 0.5, 1);
}
