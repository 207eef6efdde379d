#include "db/codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <limits>
#include <random>

namespace patchwork {
namespace {

using Codes = std::vector<std::int32_t>;
using Bytes = std::vector<std::byte>;

std::uint32_t seed() {
  const char* given = std::getenv("PATCHWORK_SEED");
  const auto s = given ? std::uint32_t(std::strtoul(given, nullptr, 10)) : 20240607u;
  std::cout << "PATCHWORK_SEED=" << s << '\n';
  return s;
}

Codes decoded(const Bytes& bytes, int cols, int rows, std::string* problem = nullptr) {
  Codes out(std::size_t(cols) * std::size_t(rows), 12345);
  const std::string text = decode_codes(bytes, cols, rows, out);
  if (problem) *problem = text;
  return out;
}

void expect_round_trip(const Codes& codes, int cols, int rows) {
  std::string problem;
  EXPECT_EQ(decoded(encode_codes(codes, cols, rows), cols, rows, &problem), codes) << cols << " x " << rows;
  EXPECT_EQ(problem, "");
}

Codes waves(int cols, int rows, double amplitude, double noise, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Codes codes;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < cols; ++x)
      codes.push_back(
          std::int32_t(amplitude * std::sin(0.03 * x) * std::cos(0.02 * y) + noise * unit(random)));
  return codes;
}

Codes anything(int cols, int rows, std::mt19937& random) {
  Codes codes(std::size_t(cols) * std::size_t(rows));
  for (std::int32_t& c : codes) c = std::int32_t(random());
  return codes;
}

Bytes bytes_of(const std::vector<int>& values) {
  Bytes out;
  for (const int v : values) out.push_back(std::byte(v));
  return out;
}

TEST(Codec, GivesBackAnyCodesOfAnyShape) {
  std::mt19937 random(seed());
  for (const int cols : {1, 2, 3, 15, 16, 17, 112})
    for (const int rows : {1, 2, 3, 4, 5, 33, 112}) {
      expect_round_trip(waves(cols, rows, 900, 0, random), cols, rows);
      expect_round_trip(waves(cols, rows, 900, 20, random), cols, rows);
      expect_round_trip(waves(cols, rows, 8e6, 100, random), cols, rows);
      expect_round_trip(anything(cols, rows, random), cols, rows);
    }
}

TEST(Codec, GivesBackTheExtremesOfInt32) {
  constexpr std::int32_t lo = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t hi = std::numeric_limits<std::int32_t>::max();
  for (const Codes& codes :
       {Codes{lo, hi, hi, lo, lo, hi}, Codes{hi, lo, 0, -1, hi, hi}, Codes{0, 0, 0, lo, lo, hi}}) {
    expect_round_trip(codes, 3, 2);
    expect_round_trip(codes, 2, 3);
  }
}

TEST(Codec, FormatIsFrozen) {
  const Bytes flat = encode_codes(Codes(12, -2), 4, 3);
  EXPECT_EQ(flat, bytes_of({1, 0, 0xfe, 0xff, 0xff, 0xff}));
  // 7 8 / 7 9: residuals 0 1 / 0 1, as zigzag 0 2 / 0 2, in one zstd frame that holds them raw.
  const Bytes written = bytes_of({1, 1, 7, 0, 0, 0, 0x28, 0xb5, 0x2f, 0xfd, 0x20, 4, 0x21, 0, 0, 0, 2, 0, 2});
  EXPECT_EQ(decoded(written, 2, 2), (Codes{7, 8, 7, 9}));
  EXPECT_EQ(encode_codes(Codes{7, 8, 7, 9}, 2, 2), written);
}

TEST(Codec, TerrainTakesFewerBytesThanNoise) {
  std::mt19937 random(seed());
  const std::size_t smooth = encode_codes(waves(112, 112, 2000, 0, random), 112, 112).size();
  const std::size_t rough = encode_codes(waves(112, 112, 2000, 50, random), 112, 112).size();
  const std::size_t noise = encode_codes(anything(112, 112, random), 112, 112).size();
  std::cout << "bytes a sample: " << double(smooth) / 12544 << ' ' << double(rough) / 12544 << ' '
            << double(noise) / 12544 << '\n';
  EXPECT_LT(double(smooth) / 12544, 0.6);
  EXPECT_LT(double(rough) / 12544, 1.2);
  EXPECT_GT(noise, 4u * 12544);  // the control: no codec gains on noise
  EXPECT_LT(noise, 4u * 12544 + 100);
}

TEST(Codec, EveryCutIsRefused) {
  std::mt19937 random(seed());
  const Bytes whole = encode_codes(waves(33, 33, 900, 500, random), 33, 33);
  std::string problem;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    decoded(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(n)), 33, 33, &problem);
    EXPECT_NE(problem, "") << n << " of " << whole.size();
  }
  decoded(whole, 33, 33, &problem);
  EXPECT_EQ(problem, "");
}

TEST(Codec, FlippedBytesNeverCrashAndTheChecksumSeesThem) {
  std::mt19937 random(seed());
  const Codes codes = waves(33, 33, 900, 500, random);
  Bytes bytes = encode_codes(codes, 33, 33);
  const std::uint64_t sum = checksum(bytes);
  int undetected = 0;
  for (std::byte& b : bytes)
    for (int bit = 0; bit < 8; ++bit) {
      b ^= std::byte(1 << bit);
      std::string problem;
      undetected += decoded(bytes, 33, 33, &problem) != codes && problem.empty();
      EXPECT_NE(checksum(bytes), sum);
      b ^= std::byte(1 << bit);
    }
  EXPECT_GT(undetected, 0);  // the control: without the checksum some flips would go unseen
  EXPECT_EQ(checksum(bytes), sum);
}

TEST(Codec, RandomBytesNeverCrash) {
  std::mt19937 random(seed());
  const Bytes sound = encode_codes(waves(20, 20, 900, 500, random), 20, 20);
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = sound;
    const std::size_t changes = 1 + random() % 40;
    for (std::size_t i = 0; i < changes; ++i) bytes[random() % bytes.size()] = std::byte(random());
    bytes.resize(random() % 2 ? bytes.size() : random() % bytes.size());
    decoded(bytes, 20, 20);
  }
}

TEST(Codec, SaysWhatIsWrong) {
  const Bytes sound = encode_codes(Codes{1, 2, 3, 4}, 2, 2);
  const auto problem_with = [&](auto change, int cols = 2, int rows = 2) {
    Bytes bytes = sound;
    change(bytes);
    std::string problem;
    decoded(bytes, cols, rows, &problem);
    return problem;
  };
  EXPECT_EQ(problem_with([](Bytes&) {}), "");
  EXPECT_EQ(problem_with([](Bytes& b) { b.resize(5); }), "codes: cut short");
  EXPECT_EQ(problem_with([](Bytes& b) { b[0] = std::byte{2}; }), "codes: unknown format");
  EXPECT_EQ(problem_with([](Bytes& b) { b[1] = std::byte{5}; }), "codes: too many byte planes");
  EXPECT_EQ(problem_with([](Bytes& b) { b[6] ^= std::byte{1}; }), "codes: byte plane 0 is damaged");
  EXPECT_EQ(problem_with([](Bytes& b) { b.push_back(std::byte{0}); }), "codes: bytes left over");
  EXPECT_EQ(problem_with([](Bytes&) {}, 3, 2), "codes: byte plane 0 is damaged");  // another rectangle
  Codes small(3);
  EXPECT_EQ(decode_codes(sound, 2, 2, small), "codes: the rectangle does not fit its buffer");
  EXPECT_EQ(decode_codes(sound, -2, -2, small), "codes: the rectangle does not fit its buffer");
}

TEST(Codec, ChecksumIsXxh3) {
  EXPECT_EQ(checksum({}), 0x2d06800538d394c2u);  // the published value of XXH3_64bits for no bytes
  EXPECT_NE(checksum(bytes_of({0})), checksum({}));
}

}  // namespace
}  // namespace patchwork
