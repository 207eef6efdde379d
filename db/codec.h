// Lossless bytes for a rectangle of integer sample codes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "db/parent_predictor.h"

namespace patchwork {

/// Codes row-major, cols * rows of them, any int32 values. Bytes made with a parent need it for decoding.
/// REQUIRES: parent is null or covers the rectangle.
std::vector<std::byte> encode_codes(std::span<const std::int32_t> codes, int cols, int rows,
                                    const ParentCodes* parent = nullptr);

/// Fills `out` (cols * rows); returns "" or what is wrong with the bytes (which are hostile until proven
/// sound). With another parent than the encoder's the codes are others.
std::string decode_codes(std::span<const std::byte> bytes, int cols, int rows, std::span<std::int32_t> out,
                         const ParentCodes* parent = nullptr);

/// 64-bit checksum of a stored blob.
std::uint64_t checksum(std::span<const std::byte> bytes);

}  // namespace patchwork
