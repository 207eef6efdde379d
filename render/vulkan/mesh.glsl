// The mesh of a block of 8 x 8 cells, for the shaders that make it. A block begins as two triangles. Each vertex but
// its corners is the middle of the longest side of the triangles that it halves: first the middle of the block, then
// those of its edges, then those of its quarters, and so on. A block's mesh is the set of its vertices, closed
// so that none is there without the two whose triangles it halves; what a neighbour has on a shared edge
// besides splits the triangles along it into fans. Four blocks that need no vertex may be one quad: two triangles of its
// corners, or fans around its middle; a side's middle is one of its vertices where it is one beyond.
#include "terrain.glsl"

// Of each block of each draw.
struct Mesh {
  uvec2 inside;     // bit 7 (y - 1) + x - 1: vertex (x, y), 1 to 7
  uint edges;       // bit 8 s + p: vertex p of side s (TileKey::beside), 1 to 7
  bool seen;
  bool falls;       // alone, its two triangles share the side from (0, 8) to (8, 0); else from (0, 0) to (8, 8)
  uint quad;        // the block is a part of one: kQuad, and kFlat where two triangles do, kQuadFalls as `falls`
};
const uint kQuad = 1u, kFlat = 2u, kQuadFalls = 4u;
const uint kUnseen = 0x80000000u, kFalls = 0x40000000u, kInsideHigh = 0x1ffffu, kEdges = 0xfefefefeu;

uvec4 packed(Mesh m) {
  return uvec4(m.inside.x, m.inside.y | (m.seen ? 0 : kUnseen) | (m.falls ? kFalls : 0), m.edges, m.quad);
}
Mesh unpacked(uvec4 t) {
  return Mesh(uvec2(t.x, t.y & kInsideHigh), t.z, (t.y & kUnseen) == 0, (t.y & kFalls) != 0, t.w);
}

// Vertices of the mesh are named by their draw and their half cells there. The 9 x 9 of a block differ in their
// low eight bits: by these llvmpipe finds those that it has already shaded.
uint name_of(int d, ivec2 at) {
  const uvec2 p = uvec2(at), far = p >> 5;
  const uvec2 near = p >> 1 & 15, odd = p & 1;
  return uint(d) << 16 | odd.y << 15 | odd.x << 14 | far.y << 11 | far.x << 8 | near.y << 4 | near.x;
}
int draw_named(uint name) { return int(name >> 16); }
ivec2 half_cells_named(uint name) {
  return ivec2((name >> 8 & 7) << 5 | (name & 15) << 1 | (name >> 14 & 1),
               (name >> 11 & 7) << 5 | (name >> 4 & 15) << 1 | (name >> 15 & 1));
}
