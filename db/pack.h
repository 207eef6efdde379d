// Structure blobs on their way to the store: packed by zstd, and back.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace patchwork {

/// Records and tree pages shrink to a third: their doubles share most bytes with their neighbours'.
std::vector<std::byte> pack(std::span<const std::byte> bytes);
/// Empty for hostile bytes: no frame, or one of more than `most` bytes.
std::optional<std::vector<std::byte>> unpack(std::span<const std::byte> bytes, std::size_t most);

}  // namespace patchwork
