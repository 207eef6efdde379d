#version 450
// A block of a drawn tile: the instance is the draw, the vertex its block.
layout(location = 0) out ivec2 block;
void main() {
  block = ivec2(gl_InstanceIndex, gl_VertexIndex);
  gl_Position = vec4(0);
}
