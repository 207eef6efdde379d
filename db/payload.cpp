#include "db/payload.h"

#include <algorithm>
#include <optional>

#include "db/codec.h"
#include "db/little_endian.h"

namespace patchwork {

namespace {
constexpr std::size_t kHeader = 8;
constexpr std::byte kMagic{'C'}, kVersion{2};
constexpr int kMaxCell = 15;

std::optional<ParentCodes> parent_codes(const Chunk* parent, int cx, int cy) {
  if (!parent) return {};
  return ParentCodes{parent->codes, parent->cols, parent->rows, cx % 2 * (kChunkVertices / 2),
                     cy % 2 * (kChunkVertices / 2)};
}
}  // namespace

Chunk make_chunk(const GridShape& shape, int level, int cx, int cy) {
  const int cols = std::min(kChunkVertices, shape.lattice_cols(level) - cx * kChunkVertices);
  const int rows = std::min(kChunkVertices, shape.lattice_rows(level) - cy * kChunkVertices);
  return {cols, rows, {}, {}};
}

std::vector<std::byte> encode_chunk(const Chunk& chunk, const Chunk* parent, int cx, int cy) {
  const std::optional<ParentCodes> above = parent_codes(parent, cx, cy);
  std::vector<std::byte> codes = encode_codes(chunk.codes, chunk.cols, chunk.rows, above ? &*above : nullptr);
  std::vector<std::byte> out;
  out.reserve(kHeader + codes.size());
  for (const std::byte b : {kMagic, kVersion, std::byte(!chunk.cells.empty()), std::byte{0}})
    out.push_back(b);
  put_little(out, std::uint32_t(codes.size()));
  out.insert(out.end(), codes.begin(), codes.end());
  if (!chunk.cells.empty()) {
    const std::vector<std::int32_t> cells(chunk.cells.begin(), chunk.cells.end());
    codes = encode_codes(cells, chunk.cols, chunk.rows);
    out.insert(out.end(), codes.begin(), codes.end());
  }
  return out;
}

std::string decode_chunk(std::span<const std::byte> bytes, Chunk& chunk, const Chunk* parent, int cx,
                         int cy) {
  if (bytes.size() < kHeader || bytes[0] != kMagic) return "not a payload chunk";
  if (bytes[1] != kVersion) return "a payload of an unknown version";
  const std::size_t length = get_little<std::uint32_t>(bytes.data() + 4);
  if (length > bytes.size() - kHeader) return "a payload that ends early";
  const std::size_t n = size_t(chunk.cols) * size_t(chunk.rows);
  chunk.codes.resize(n), chunk.cells.clear();
  const auto rest = bytes.subspan(kHeader);
  const std::optional<ParentCodes> above = parent_codes(parent, cx, cy);
  if (std::string bad =
          decode_codes(rest.first(length), chunk.cols, chunk.rows, chunk.codes, above ? &*above : nullptr);
      !bad.empty())
    return bad;
  if (bytes[2] == std::byte{0}) return length == rest.size() ? "" : "a payload with bytes left over";
  std::vector<std::int32_t> cells(n);
  if (std::string bad = decode_codes(rest.subspan(length), chunk.cols, chunk.rows, cells); !bad.empty())
    return bad;
  chunk.cells.reserve(n);
  for (const std::int32_t c : cells) {
    if (c < 0 || c > kMaxCell) return "a payload with an impossible cell mask";
    chunk.cells.push_back(std::uint8_t(c));
  }
  return "";
}

}  // namespace patchwork
