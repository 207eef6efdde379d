#include "db/differences.h"

#define ZSTD_STATIC_LINKING_ONLY  // for ZSTD_c_literalCompressionMode
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <utility>

#include "db/vectorized.h"

// A run of n differences, as zigzag (0, -1, 1, -2, ... become 0, 1, 2, 3, ...), cut into parts of w bits from
// the lowest up. A part is packed into m = ceil(n w / 8) bytes: byte b holds it of differences b, b + m,
// b + 2 m, ... from its low end up.
//   byte 0   planes, 0 to 5
//   byte 1   k + 16 f: how many low bits are kept as they are (0 to 15), width of the first plane (2, 4 or 8)
//   for each bit that is set in k, from the lowest up, a part as wide as its value (1, 2, 4 or 8)
//   `planes` zstd frames of a part each, the first of f bits, the others of 8; above them are zeros
// A run of zeros is two bytes.

namespace patchwork {

namespace {

constexpr int kMaxPlanes = 5, kMaxLowBits = 15;
// The mean of what is left above the low bits, at most: those are nearly random, and the fewer values zstd
// meets the shorter its tables are. Puget Sound, all levels: 4 1.145 bytes a sample, 8 to 16 1.139, 32 1.145,
// no low bits 1.174 and a fifth slower.
constexpr double kHighMean = 8;
// Below these means two and four differences share a byte, as zstd spends at least one bit on each: the
// terrain interpolated to 40 m falls from 0.263 to 0.236 bytes a sample, at 0.5 m from 0.177 to 0.123.
constexpr double kPairMean = 1.5, kQuadMean = 0.3;
// Differences hardly ever repeat, so zstd is to code bytes by frequency and not to search long for matches:
// plain level 1 takes 1.152 bytes a sample there, 75 % more time to encode and 20 % more to decode.
constexpr std::pair<ZSTD_cParameter, int> kTuning[] = {{ZSTD_c_compressionLevel, 1},
                                                       {ZSTD_c_minMatch, 7},
                                                       {ZSTD_c_hashLog, 10},
                                                       {ZSTD_c_targetLength, 64},
                                                       {ZSTD_c_literalCompressionMode, ZSTD_ps_enable}};

// What a thread keeps between calls: setting up zstd contexts costs more than coding a run.
struct Scratch {
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> compressor{ZSTD_createCCtx(), &ZSTD_freeCCtx};
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> decompressor{ZSTD_createDCtx(), &ZSTD_freeDCtx};
  std::vector<std::uint32_t> folded;  // as zigzag
  std::vector<std::uint8_t> bytes;

  Scratch() {
    if (!compressor || !decompressor) throw std::bad_alloc();
    for (const auto& [name, value] : kTuning) ZSTD_CCtx_setParameter(compressor.get(), name, value);
  }
};

Scratch& scratch() {
  thread_local Scratch s;
  return s;
}

struct Profile {
  std::uint32_t bits = 0;  // that occur in any of them
  std::uint64_t sum = 0, nonzero = 0;
};

PATCHWORK_VECTORIZED Profile fold(const std::int32_t* from, std::size_t n, std::uint32_t* __restrict to) {
  Profile p;
  for (std::size_t i = 0; i < n; ++i) {
    const auto d = std::uint32_t(from[i]);
    to[i] = d << 1 ^ (0u - (d >> 31));
    p.bits |= to[i], p.sum += to[i], p.nonzero += to[i] != 0;
  }
  return p;
}

PATCHWORK_VECTORIZED void unfold(std::uint32_t* folded, std::size_t n, std::int32_t* __restrict to) {
  for (std::size_t i = 0; i < n; ++i) to[i] = std::int32_t(folded[i] >> 1 ^ (0u - (folded[i] & 1)));
}

// Where more bits than that are random, whole bytes of them are left to zstd, which stores them as they are.
int low_bits_for(const Profile& p, std::size_t n) {
  const double share = double(p.sum) / double(n) / kHighMean;
  const int bits = share < 1 ? 0 : std::ilogb(share) + 1;
  return bits <= kMaxLowBits ? bits : bits % 8 + 8;
}

int first_width_for(const Profile& p, std::size_t n) {
  const double mean = double(p.sum) / double(n);
  if (p.sum > 4 * p.nonzero) return 8;  // rare and large: zstd finds the zeros between them
  return mean < kQuadMean ? 2 : mean < kPairMean ? 4 : 8;
}

int planes_for(std::uint32_t bits, int first_width) {
  int planes = bits != 0;
  for (bits >>= first_width; bits; bits >>= 8) ++planes;
  return planes;
}

std::size_t packed_bytes(std::size_t n, int width) { return (n * std::size_t(width) + 7) / 8; }

PATCHWORK_VECTORIZED void pack(const std::uint32_t* from, std::size_t n, int shift, int width,
                               std::uint8_t* __restrict to) {
  const std::size_t bytes = packed_bytes(n, width);
  const std::uint32_t mask = (1u << width) - 1;
  for (std::size_t start = 0, place = 0; start < n; start += bytes, place += std::size_t(width))
    for (std::size_t i = start; i < std::min(n, start + bytes); ++i)
      to[i - start] = std::uint8_t(to[i - start] | (from[i] >> shift & mask) << place);
}

PATCHWORK_VECTORIZED void unpack(const std::uint8_t* from, std::size_t n, int shift, int width,
                                 std::uint32_t* __restrict to) {
  const std::size_t bytes = packed_bytes(n, width);
  const std::uint32_t mask = (1u << width) - 1;
  for (std::size_t start = 0, place = 0; start < n; start += bytes, place += std::size_t(width))
    for (std::size_t i = start; i < std::min(n, start + bytes); ++i)
      to[i] |= (std::uint32_t(from[i - start]) >> place & mask) << shift;
}

void append_frame(const std::vector<std::uint8_t>& plane, std::vector<std::byte>& out) {
  const std::size_t start = out.size(), room = ZSTD_compressBound(plane.size());
  out.resize(start + room);
  const std::size_t written =
      ZSTD_compress2(scratch().compressor.get(), out.data() + start, room, plane.data(), plane.size());
  if (ZSTD_isError(written)) throw std::bad_alloc();  // the room suffices: nothing else can be wrong
  out.resize(start + written);
}

// Takes one frame of exactly n bytes off the front of `bytes`; false if there is none.
bool take_frame(std::span<const std::byte>& bytes, std::uint8_t* to, std::size_t n) {
  const std::size_t frame = ZSTD_findFrameCompressedSize(bytes.data(), bytes.size());
  if (ZSTD_isError(frame)) return false;
  if (ZSTD_decompressDCtx(scratch().decompressor.get(), to, n, bytes.data(), frame) != n) return false;
  bytes = bytes.subspan(frame);
  return true;
}

}  // namespace

void append_differences(std::span<const std::int32_t> differences, std::vector<std::byte>& out) {
  Scratch& s = scratch();
  const std::size_t n = differences.size();
  s.folded.resize(n), s.bytes.resize(n);
  const Profile profile = fold(differences.data(), n, s.folded.data());
  const int k = n ? low_bits_for(profile, n) : 0, first = n ? first_width_for(profile, n) : 8;
  const int planes = planes_for(profile.bits >> k, first);
  out.push_back(std::byte(planes)), out.push_back(std::byte(k | first << 4));
  for (int width = 1, shift = 0; width <= k; shift += k & width, width *= 2) {
    if (!(k & width)) continue;
    const std::size_t start = out.size();
    out.resize(start + packed_bytes(n, width));
    pack(s.folded.data(), n, shift, width, reinterpret_cast<std::uint8_t*>(out.data() + start));
  }
  for (int plane = 0; plane < planes; ++plane) {
    const int width = plane ? 8 : first, shift = plane ? k + first + 8 * (plane - 1) : k;
    s.bytes.assign(packed_bytes(n, width), 0);
    pack(s.folded.data(), n, shift, width, s.bytes.data());
    append_frame(s.bytes, out);
  }
}

std::string take_differences(std::span<const std::byte>& bytes, std::span<std::int32_t> out) {
  if (bytes.size() < 2) return "codes: cut short";
  const int planes = int(bytes[0]), k = int(bytes[1]) & 15, first = int(bytes[1]) >> 4;
  if (planes > kMaxPlanes || (first != 2 && first != 4 && first != 8))
    return "codes: an impossible run of differences";
  bytes = bytes.subspan(2);
  const std::size_t n = out.size();
  if (planes == 0 && k == 0) return std::fill(out.begin(), out.end(), 0), "";
  Scratch& s = scratch();
  s.folded.assign(n, 0), s.bytes.resize(n);
  for (int width = 1, shift = 0; width <= k; shift += k & width, width *= 2) {
    if (!(k & width)) continue;
    const std::size_t size = packed_bytes(n, width);
    if (bytes.size() < size) return "codes: cut short";
    unpack(reinterpret_cast<const std::uint8_t*>(bytes.data()), n, shift, width, s.folded.data());
    bytes = bytes.subspan(size);
  }
  for (int plane = 0; plane < planes; ++plane) {
    const int width = plane ? 8 : first, shift = plane ? k + first + 8 * (plane - 1) : k;
    if (!take_frame(bytes, s.bytes.data(), packed_bytes(n, width)))
      return "codes: byte plane " + std::to_string(plane) + " is damaged";
    unpack(s.bytes.data(), n, std::min(31, shift), width, s.folded.data());
  }
  unfold(s.folded.data(), n, out.data());
  return {};
}

}  // namespace patchwork
