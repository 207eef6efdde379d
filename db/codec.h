// Lossless bytes for a rectangle of integer sample codes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace patchwork {

/// Codes row-major, cols * rows of them, any int32 values.
std::vector<std::byte> encode_codes(std::span<const std::int32_t> codes, int cols, int rows);

/// Fills `out` (cols * rows); returns "" or what is wrong with the bytes (which are hostile until proven
/// sound).
std::string decode_codes(std::span<const std::byte> bytes, int cols, int rows, std::span<std::int32_t> out);

/// 64-bit checksum of a stored blob.
std::uint64_t checksum(std::span<const std::byte> bytes);

}  // namespace patchwork
