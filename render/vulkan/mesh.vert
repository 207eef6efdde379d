#version 450
// A vertex of the mesh (triangles.comp).
#extension GL_GOOGLE_include_directive : require
#include "mesh.glsl"

layout(location = 0) out vec4 local;

void main() {
  const uint name = uint(gl_VertexIndex);
  const Vertex v = vertex_at(draw_named(name), half_cells_named(name));
  local = v.local, gl_Position = v.place;
}
