// Payload chunks: whatever the bytes, codes of the wanted size or a complaint; what is accepted can be
// stored.
#include <algorithm>

#include "db/payload.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace patchwork;
  fuzz::Input input(data, size);
  const int width = 2 + input.byte(), height = 2 + input.byte();
  const bool with_parent = input.byte() % 2 == 1;
  const GridShape shape(width, height, true);
  Chunk chunk = make_chunk(shape, 0, 0, 0), again = chunk, parent = make_chunk(shape, 1, 0, 0);
  for (std::size_t k = 0; k < std::size_t(parent.cols) * std::size_t(parent.rows); ++k)
    parent.codes.push_back(std::int32_t(k * k % 1000));
  parent.codes.resize(std::size_t(parent.cols) * std::size_t(parent.rows));
  const Chunk* const above = with_parent && shape.levels() > 1 ? &parent : nullptr;
  if (!decode_chunk(input.rest(), chunk, above, 0, 0).empty()) return 0;
  fuzz::require(chunk.codes.size() == std::size_t(chunk.cols) * std::size_t(chunk.rows),
                "a code for each vertex");
  fuzz::require(std::all_of(chunk.cells.begin(), chunk.cells.end(), [](std::uint8_t c) { return c < 16; }),
                "cells are masks");
  const std::vector<std::byte> bytes = encode_chunk(chunk, above, 0, 0);
  fuzz::require(decode_chunk(bytes, again, above, 0, 0).empty(), "what is encoded can be decoded");
  fuzz::require(again.codes == chunk.codes && again.cells == chunk.cells, "and is what it was");
  return 0;
}
