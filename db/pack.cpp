#include "db/pack.h"

#include <zstd.h>

#include <new>

namespace patchwork {

std::vector<std::byte> pack(std::span<const std::byte> bytes) {
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const std::size_t written = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1);
  if (ZSTD_isError(written)) throw std::bad_alloc();  // the room suffices: nothing else can be wrong
  out.resize(written);
  return out;
}

std::optional<std::vector<std::byte>> unpack(std::span<const std::byte> bytes, std::size_t most) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN || size > most) return std::nullopt;
  std::vector<std::byte> out(size);
  if (ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size()) != out.size()) return std::nullopt;
  return out;
}

}  // namespace patchwork
