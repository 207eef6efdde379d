#version 450
// A vertex of plain triangles that cover the picture.
layout(binding = 0) uniform FrameBlock {
  mat4 clip;
  vec4 from;   // xy: vertex (0, 0) in the picture; w: columns of vertices
  vec4 steps;  // xy: from column to column; zw: from row to row
} frame;

void main() {
  const int columns = int(frame.from.w);
  gl_Position = vec4(frame.from.xy + float(gl_VertexIndex % columns) * frame.steps.xy +
                         float(gl_VertexIndex / columns) * frame.steps.zw, 0.5, 1);
}
