#include "db/codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <limits>
#include <random>

#include "db/differences.h"

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

Codes decoded(const Bytes& bytes, int cols, int rows, std::string* problem = nullptr,
              const ParentCodes* parent = nullptr) {
  Codes out(std::size_t(cols) * std::size_t(rows), 12345);
  const std::string text = decode_codes(bytes, cols, rows, out, parent);
  if (problem) *problem = text;
  return out;
}

void expect_round_trip(const Codes& codes, int cols, int rows, const ParentCodes* parent = nullptr) {
  std::string problem;
  EXPECT_EQ(decoded(encode_codes(codes, cols, rows, parent), cols, rows, &problem, parent), codes)
      << cols << " x " << rows;
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

// A chunk's codes with those of the level above, whose first vertex is not the chunk's.
struct Family {
  int cols, rows, parent_cols, parent_rows, i, j;
  Codes codes, above;
  ParentCodes parent() const { return {above, parent_cols, parent_rows, i, j}; }
};

// Decimates a larger `whole` of the parent's extent; the chunk is cut from it.
Family family(const Codes& whole, int cols, int rows, int parent_cols, int parent_rows, int i, int j) {
  Family f{cols, rows, parent_cols, parent_rows, i, j, {}, {}};
  const auto at = [&](int x, int y) {
    return whole[std::size_t(y) * 2 * std::size_t(parent_cols) + std::size_t(x)];
  };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < cols; ++x) f.codes.push_back(at(2 * i + x, 2 * j + y));
  for (int y = 0; y < parent_rows; ++y)
    for (int x = 0; x < parent_cols; ++x) f.above.push_back(at(2 * x, 2 * y));
  return f;
}

Family wave_family(double noise, std::mt19937& random) {
  return family(waves(80, 80, 2000, noise, random), 33, 34, 40, 40, 20, 10);
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
  EXPECT_EQ(flat, bytes_of({2, 0, 0xfe, 0xff, 0xff, 0xff, 0, 0x20}));
  // 7 8 / 7 9: residuals 0 1 / 0 1, as zigzag 0 2 / 0 2, two a byte in one zstd frame that holds them raw.
  const Bytes written =
      bytes_of({2, 0, 7, 0, 0, 0, 1, 0x40, 0x28, 0xb5, 0x2f, 0xfd, 0x20, 2, 0x11, 0, 0, 0, 0x22});
  EXPECT_EQ(decoded(written, 2, 2), (Codes{7, 8, 7, 9}));
  EXPECT_EQ(encode_codes(Codes{7, 8, 7, 9}, 2, 2), written);
}

TEST(Codec, FormatOfLowBitsIsFrozen) {
  // Differences of 100 and a last one of -100 are 200 and 199 as zigzag, 11001000 and 11000111: with five
  // low bits, 1 and 4 of them, the rest is 6, in one zstd frame that holds it raw.
  Bytes bytes{};
  Codes differences(16, 100);
  differences[15] = -100;
  append_differences(differences, bytes);
  Bytes expected = bytes_of({1, 0x85, 0, 0x80, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44, 0x44, 0x34});
  for (const std::byte b : bytes_of({0x28, 0xb5, 0x2f, 0xfd, 0x20, 16, 0x81, 0, 0})) expected.push_back(b);
  expected.resize(expected.size() + 16, std::byte{6});
  EXPECT_EQ(bytes, expected);
  Codes back(16);
  std::span<const std::byte> rest = bytes;
  EXPECT_EQ(take_differences(rest, back), "");
  EXPECT_EQ(back, differences);
  EXPECT_TRUE(rest.empty());
}

TEST(Codec, FormatWithAParentIsFrozen) {
  const Codes parent_codes{0, 8, 16, 24};
  const ParentCodes parent{parent_codes, 2, 2, 0, 0};
  const Codes plane{0, 4, 8, 8, 12, 16, 16, 20, 24}, bump{0, 4, 8, 8, 13, 16, 16, 20, 24};
  const Bytes no_news = bytes_of({2, 1, 5, 5, 0, 0x20, 0, 0x20});
  EXPECT_EQ(encode_codes(plane, 3, 3, &parent), no_news);
  EXPECT_EQ(decoded(no_news, 3, 3, nullptr, &parent), plane);
  const Bytes written =
      bytes_of({2, 1, 5, 5, 0, 0x20, 1, 0x40, 0x28, 0xb5, 0x2f, 0xfd, 0x20, 3, 0x19, 0, 0, 2, 0, 0});
  EXPECT_EQ(encode_codes(bump, 3, 3, &parent), written);
  EXPECT_EQ(decoded(written, 3, 3, nullptr, &parent), bump);
}

TEST(Codec, GivesBackAnyCodesOfAnyShapeWithAnyParent) {
  std::mt19937 random(seed());
  for (const int cols : {1, 2, 3, 8, 17, 56, 112})
    for (const int rows : {1, 2, 3, 4, 33, 112})
      for (const int more : {0, 1, 5}) {
        const int evens_i = (cols + 1) / 2, evens_j = (rows + 1) / 2;
        const int w = evens_i + more, h = evens_j + more;
        for (const int at : {0, more}) {
          const Family f = family(waves(2 * w, 2 * h, 900, 20, random), cols, rows, w, h, at, more - at);
          const ParentCodes parent = f.parent();
          expect_round_trip(f.codes, cols, rows, &parent);
          expect_round_trip(anything(cols, rows, random), cols, rows, &parent);  // not even related
          const Codes wild = anything(w, h, random);
          const ParentCodes unrelated{wild, w, h, at, more - at};
          expect_round_trip(f.codes, cols, rows, &unrelated);
        }
      }
}

TEST(Codec, GivesBackTheExtremesOfInt32WithAParentOfExtremes) {
  constexpr std::int32_t ends[] = {std::numeric_limits<std::int32_t>::min(),
                                   std::numeric_limits<std::int32_t>::max()};
  std::mt19937 random(seed());
  for (int round = 0; round < 50; ++round) {
    Codes codes(40 * 20), above(25 * 15);
    for (Codes* c : {&codes, &above})
      for (std::int32_t& v : *c) v = ends[random() % 2];
    const ParentCodes parent{above, 25, 15, int(random() % 6), int(random() % 6)};
    expect_round_trip(codes, 40, 20, &parent);
  }
}

TEST(Codec, WhatTheParentHoldsCostsNothing) {
  std::mt19937 random(seed());
  const Codes whole = waves(224, 224, 2000, 8, random);
  for (const int i : {0, 56})
    for (const int j : {0, 56}) {
      Family f = family(whole, 112, 112, 112, 112, i, j);
      const ParentCodes parent = f.parent();
      const auto alone = double(encode_codes(f.codes, 112, 112).size());
      const auto with = double(encode_codes(f.codes, 112, 112, &parent).size());
      EXPECT_LT(with, 0.75 * alone);
      // A far end that was continued otherwise costs its own vertices, not the others.
      for (int y = 0; y < 112; y += 2) f.codes[std::size_t(y) * 112 + 110] += 9;
      EXPECT_LT(double(encode_codes(f.codes, 112, 112, &parent).size()), with + 3 * 112 + 50);
      expect_round_trip(f.codes, 112, 112, &parent);
      // The control: another parent is no help.
      const Codes other = waves(112, 112, 2000, 500, random);
      const ParentCodes wrong{other, 112, 112, i, j};
      EXPECT_GT(double(encode_codes(f.codes, 112, 112, &wrong).size()), alone);
    }
}

TEST(Codec, WeightsFollowTheTerrain) {
  std::mt19937 random(seed());
  const auto weight = [&](double amplitude, double noise) {
    const Family f = family(waves(224, 224, amplitude, noise, random), 112, 112, 112, 112, 56, 56);
    const ParentCodes parent = f.parent();
    return int(std::int8_t(encode_codes(f.codes, 112, 112, &parent)[2]));
  };
  EXPECT_NEAR(weight(0, 900), -11, 2);  // noise: the mean of all twelve neighbours
  EXPECT_EQ(weight(9e6, 0), 4);         // smooth: exact for quadratic surfaces
}

TEST(Codec, ItsParentIsNeededForDecoding) {
  std::mt19937 random(seed());
  const Family f = wave_family(20, random);
  const ParentCodes parent = f.parent();
  const Bytes bytes = encode_codes(f.codes, f.cols, f.rows, &parent);
  std::string problem;
  decoded(bytes, f.cols, f.rows, &problem);
  EXPECT_EQ(problem, "codes: made with a parent");
  decoded(encode_codes(f.codes, f.cols, f.rows), f.cols, f.rows, &problem, &parent);
  EXPECT_EQ(problem, "codes: made without a parent");
  ParentCodes moved = parent;
  moved.i += 4;  // the chunk would reach beyond it
  decoded(bytes, f.cols, f.rows, &problem, &moved);
  EXPECT_EQ(problem, "codes: the parent does not cover the rectangle");
  moved.i = parent.i - 1;
  EXPECT_NE(decoded(bytes, f.cols, f.rows, &problem, &moved), f.codes);
  EXPECT_EQ(problem, "");  // another parent cannot be told: checksums are the store's
}

TEST(Codec, DamagedBytesWithAParentNeverCrash) {
  std::mt19937 random(seed());
  const Family f = wave_family(300, random);
  const ParentCodes parent = f.parent();
  const Bytes whole = encode_codes(f.codes, f.cols, f.rows, &parent);
  std::string problem;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    decoded(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(n)), f.cols, f.rows, &problem, &parent);
    EXPECT_NE(problem, "") << n << " of " << whole.size();
  }
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes bytes = whole;
    bytes[bit / 8] ^= std::byte(1 << bit % 8);
    EXPECT_EQ(decoded(bytes, f.cols, f.rows, &problem, &parent).size(), f.codes.size());
  }
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes = whole;
    for (std::size_t i = 0; i < 1 + random() % 40; ++i) bytes[random() % 60] = std::byte(random());
    decoded(bytes, f.cols, f.rows, &problem, &parent);
  }
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
  EXPECT_EQ(problem_with([](Bytes& b) { b[0] = std::byte{1}; }), "codes: unknown format");
  EXPECT_EQ(problem_with([](Bytes& b) { b[6] = std::byte{6}; }), "codes: an impossible run of differences");
  EXPECT_EQ(problem_with([](Bytes& b) { b[7] = std::byte{16}; }), "codes: an impossible run of differences");
  EXPECT_EQ(problem_with([](Bytes& b) { b[8] ^= std::byte{1}; }), "codes: byte plane 0 is damaged");
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
