#include "db/codec.h"

#include <cassert>

#include "db/differences.h"
#include "db/little_endian.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

// Format 2, little-endian:
//   byte 0      the format number, 2
//   byte 1      0: without a parent, 1: with one
// without a parent:
//   bytes 2..5  base: the first code, also the value of every sample outside the rectangle
//   a run of cols * rows differences (differences.h): each code less its prediction modulo 2^32, which is the
//   median of left, above and left + above - corner; in the first column it is the code above
// with a parent (parent_predictor.h):
//   bytes 2, 3  int8 centre_weight, edge_weight
//   a run of differences at the even vertices, a run of those at the others
// and nothing behind them.

namespace patchwork {

namespace {

constexpr std::uint8_t kFormat = 2;

// Wraps around like the decoder, so any codes are allowed.
std::int32_t predict(std::int32_t left, std::int32_t above, std::int32_t corner) {
  const auto plane = std::int32_t(std::uint32_t(left) + std::uint32_t(above) - std::uint32_t(corner));
  // Conditionals, not std::min: GCC 12 makes branches of those, and decoding noise takes twice as long.
  const std::int32_t low = left < above ? left : above, high = left < above ? above : left;
  const std::int32_t capped = plane < high ? plane : high;
  return capped > low ? capped : low;
}

std::int32_t restore(std::int32_t prediction, std::int32_t difference) {
  return std::int32_t(std::uint32_t(prediction) + std::uint32_t(difference));
}

void differences_of_row(const std::int32_t* row, const std::int32_t* above, std::size_t cols,
                        std::int32_t* out) {
  const auto less = [](std::int32_t a, std::int32_t b) {
    return std::int32_t(std::uint32_t(a) - std::uint32_t(b));
  };
  out[0] = less(row[0], above[0]);
  for (std::size_t x = 1; x < cols; ++x) out[x] = less(row[x], predict(row[x - 1], above[x], above[x - 1]));
}

// A row in place, from differences to codes.
void restore_row(std::int32_t* row, const std::int32_t* above, std::size_t cols) {
  std::int32_t left = above[0], corner = above[0];
  for (std::size_t x = 0; x < cols; ++x) {
    left = restore(predict(left, above[x], corner), row[x]);
    corner = above[x];
    row[x] = left;
  }
}

// Two rows in place, the second one column behind the first: two chains of dependent steps that the processor
// runs side by side.
void restore_two_rows(std::int32_t* row, const std::int32_t* above, std::size_t cols) {
  std::int32_t* next = row + cols;
  std::int32_t left = restore(above[0], row[0]), corner = above[0];
  row[0] = left;
  std::int32_t next_left = left, next_corner = left;
  for (std::size_t x = 1; x < cols; ++x) {
    const std::int32_t next_above = left;
    corner = above[x - 1];
    left = restore(predict(left, above[x], corner), row[x]);
    next_left = restore(predict(next_left, next_above, next_corner), next[x - 1]);
    next_corner = next_above;
    row[x] = left;
    next[x - 1] = next_left;
  }
  next[cols - 1] = restore(predict(next_left, left, next_corner), next[cols - 1]);
}

void restore_rows(std::int32_t* codes, std::size_t cols, std::size_t rows, std::int32_t base) {
  const std::vector<std::int32_t> base_row(cols, base);
  const std::int32_t* above = base_row.data();
  std::size_t y = 0;
  for (; y + 1 < rows; y += 2) {
    restore_two_rows(codes + y * cols, above, cols);
    above = codes + (y + 1) * cols;
  }
  if (y < rows) restore_row(codes + y * cols, above, cols);
}

void encode_alone(std::span<const std::int32_t> codes, std::size_t cols, std::size_t rows,
                  std::vector<std::byte>& out) {
  put_little(out, codes[0]);
  thread_local std::vector<std::int32_t> differences;
  differences.resize(codes.size());
  const std::vector<std::int32_t> base_row(cols, codes[0]);
  for (std::size_t y = 0; y < rows; ++y) {
    const std::int32_t* row = codes.data() + y * cols;
    differences_of_row(row, y ? row - cols : base_row.data(), cols, differences.data() + y * cols);
  }
  append_differences(differences, out);
}

void encode_with_parent(std::span<const std::int32_t> codes, int cols, int rows, const ParentCodes& parent,
                        std::vector<std::byte>& out) {
  thread_local BeyondParent beyond;
  subtract_parent(codes, cols, rows, parent, beyond);
  out.push_back(std::byte(beyond.centre_weight)), out.push_back(std::byte(beyond.edge_weight));
  append_differences(beyond.even, out);
  append_differences(beyond.odd, out);
}

std::string decode_alone(std::span<const std::byte>& bytes, std::size_t cols, std::size_t rows,
                         std::span<std::int32_t> out) {
  if (bytes.size() < 4) return "codes: cut short";
  const auto base = get_little<std::int32_t>(bytes.data());
  bytes = bytes.subspan(4);
  if (std::string bad = take_differences(bytes, out); !bad.empty()) return bad;
  restore_rows(out.data(), cols, rows, base);
  return {};
}

std::string decode_with_parent(std::span<const std::byte>& bytes, int cols, int rows,
                               const ParentCodes& parent, std::span<std::int32_t> out) {
  if (bytes.size() < 2) return "codes: cut short";
  thread_local BeyondParent beyond;
  beyond.resize(cols, rows);
  beyond.centre_weight = std::int8_t(bytes[0]), beyond.edge_weight = std::int8_t(bytes[1]);
  bytes = bytes.subspan(2);
  if (std::string bad = take_differences(bytes, beyond.even); !bad.empty()) return bad;
  if (std::string bad = take_differences(bytes, beyond.odd); !bad.empty()) return bad;
  add_parent(beyond, cols, rows, parent, out);
  return {};
}

}  // namespace

std::vector<std::byte> encode_codes(std::span<const std::int32_t> codes, int cols, int rows,
                                    const ParentCodes* parent) {
  assert(cols > 0 && rows > 0 && codes.size() == std::size_t(cols) * std::size_t(rows));
  std::vector<std::byte> out{std::byte{kFormat}, std::byte(parent != nullptr)};
  if (parent)
    encode_with_parent(codes, cols, rows, *parent, out);
  else
    encode_alone(codes, std::size_t(cols), std::size_t(rows), out);
  return out;
}

std::string decode_codes(std::span<const std::byte> bytes, int cols, int rows, std::span<std::int32_t> out,
                         const ParentCodes* parent) {
  if (cols <= 0 || rows <= 0 || out.size() != std::size_t(cols) * std::size_t(rows))
    return "codes: the rectangle does not fit its buffer";
  if (parent && !parent->covers(cols, rows)) return "codes: the parent does not cover the rectangle";
  if (bytes.size() < 2) return "codes: cut short";
  if (bytes[0] != std::byte{kFormat}) return "codes: unknown format";
  if (bytes[1] != std::byte(parent != nullptr))
    return parent ? "codes: made without a parent" : "codes: made with a parent";
  bytes = bytes.subspan(2);
  std::string bad = parent ? decode_with_parent(bytes, cols, rows, *parent, out)
                           : decode_alone(bytes, std::size_t(cols), std::size_t(rows), out);
  if (bad.empty() && !bytes.empty()) bad = "codes: bytes left over";
  return bad;
}

std::uint64_t checksum(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

}  // namespace patchwork
