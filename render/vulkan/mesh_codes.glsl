// How a block's errors stand in a slot, for mesh_finish.comp that writes them and needs.comp that reads them: a texel of
// facts, then the codes of vertices, sixteen a texel. A code is a float without so many of its low bits. Facts: lowest and
// highest point; what is taken from codes, over flags: whether the block falls, which of its sides have holes; what its
// patches lack. Where no vertex has a code, a quad's first block has its errors, metres.
const uint kBlockFalls = 1u;
const int kHolesShift = 1, kFlagBits = 5;  // of four bits, one a side
const int kBlock = 7, kCodeShift = 19;  // texels of a block (TileStore has as many); bits
const int kQuadErrors = 4;              // the texel: y as two triangles, z with the middle, w: as two it falls
