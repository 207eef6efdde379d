#version 450
// A vertex of the whole grid as one mesh: no level of detail.
layout(binding = 0) uniform FrameBlock {
  mat4 clip;
  vec4 from;   // xyz: vertex (0, 0) at height 0, metres from the eye; w: columns
  vec4 steps;  // xy: from column to column; zw: from row to row, metres
} frame;
layout(binding = 1) uniform samplerBuffer vertices;  // height, dh/dx, dh/dy
layout(location = 0) out vec3 normal;

void main() {
  const int columns = int(frame.from.w);
  const vec4 v = texelFetch(vertices, gl_VertexIndex);
  const vec2 at = float(gl_VertexIndex % columns) * frame.steps.xy + float(gl_VertexIndex / columns) * frame.steps.zw;
  normal = vec3(-v.yz, 1);
  gl_Position = frame.clip * vec4(frame.from.xy + at, frame.from.z + v.x, 1);
}
