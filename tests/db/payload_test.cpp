// The stored form of a chunk: what is put in comes out, and hostile bytes are refused.
#include "db/payload.h"

#include <gtest/gtest.h>

#include <random>

#include "db/parent_predictor.h"
#include "tests/seed.h"

namespace patchwork {
namespace {

using Blob = std::vector<std::byte>;

Chunk chunk(int cols, int rows, bool cells, std::mt19937_64& random) {
  Chunk c{cols, rows, {}, {}};
  for (int k = 0; k < cols * rows; ++k) {
    c.codes.push_back(std::int32_t(random() % 2000) - 1000);
    if (cells) c.cells.push_back(std::uint8_t(random() % 16));
  }
  return c;
}

// Decodes into a chunk of the same size; `what` is the problem, empty for none.
Chunk decoded(const Blob& bytes, const Chunk& like, std::string& what) {
  Chunk c{like.cols, like.rows, {}, {}};
  what = decode_chunk(bytes, c);
  return c;
}

TEST(Payload, GivesBackCodesAndCells) {
  std::mt19937_64 random(test_seed(1));
  for (const auto& [cols, rows] :
       std::vector<std::pair<int, int>>{{1, 1}, {2, 1}, {1, 7}, {37, 20}, {112, 112}})
    for (const bool cells : {false, true}) {
      const Chunk c = chunk(cols, rows, cells, random);
      std::string what;
      const Chunk back = decoded(encode_chunk(c), c, what);
      EXPECT_EQ(what, "");
      EXPECT_EQ(back.codes, c.codes);
      EXPECT_EQ(back.cells, c.cells);
    }
}

// The parent of four chunks of `side` vertices, and the chunks, from one smooth surface with noise.
Chunk cut(int step, int i0, int j0, int side, std::mt19937_64 noise) {
  Chunk c{side, side, {}, {}};
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const int x = (i0 + i) * step, y = (j0 + j) * step;
      noise.seed(std::uint64_t(x) << 32 | std::uint64_t(y));
      c.codes.push_back(x * x / 90 - x * y / 70 + int(noise() % 8));
    }
  return c;
}

TEST(Payload, EachOfTheFourChunksOfAParentIsItsOwnQuarter) {
  std::mt19937_64 random(test_seed(5));
  const Chunk parent = cut(2, 0, 0, kChunkVertices, random);
  for (const int cx : {0, 1})
    for (const int cy : {0, 1}) {
      const Chunk c = cut(1, cx * kChunkVertices, cy * kChunkVertices, kChunkVertices, random);
      const Blob bytes = encode_chunk(c, &parent, cx, cy);
      EXPECT_LT(double(bytes.size()), 0.8 * double(encode_chunk(c).size()));
      Chunk back{c.cols, c.rows, {}, {}};
      EXPECT_EQ(decode_chunk(bytes, back, &parent, cx + 6, cy + 2), "");
      EXPECT_EQ(back.codes, c.codes);
      EXPECT_EQ(decode_chunk(bytes, back, &parent, 1 - cx, cy), "");
      EXPECT_NE(back.codes, c.codes);  // the control: another quarter is another prediction
      EXPECT_EQ(decode_chunk(bytes, back), "codes: made with a parent");
    }
}

TEST(Payload, EveryChunkOfAGridHasItsEvenVerticesInOneParent) {
  std::mt19937_64 random(test_seed(6));
  std::vector<std::pair<int, int>> sizes{{2, 2}, {113, 225}, {226, 112}, {449, 450}, {1025, 337}};
  for (int k = 0; k < 20; ++k) sizes.emplace_back(2 + int(random() % 1500), 2 + int(random() % 1500));
  for (const auto& [width, height] : sizes) {
    const GridShape shape(width, height, true);
    EXPECT_EQ(shape.chunks_i(shape.levels() - 1) * shape.chunks_j(shape.levels() - 1), 1);
    for (int level = 0; level + 1 < shape.levels(); ++level)
      for (int cy = 0; cy < shape.chunks_j(level); ++cy)
        for (int cx = 0; cx < shape.chunks_i(level); ++cx) {
          const Chunk c = make_chunk(shape, level, cx, cy), p = make_chunk(shape, level + 1, cx / 2, cy / 2);
          const std::vector<std::int32_t> codes(std::size_t(p.cols) * std::size_t(p.rows));
          EXPECT_TRUE(
              (ParentCodes{codes, p.cols, p.rows, 56 * (cx % 2), 56 * (cy % 2)}.covers(c.cols, c.rows)))
              << width << " x " << height << ", level " << level << ", chunk " << cx << ", " << cy;
        }
  }
}

TEST(Payload, AnotherShapeVersionOrMagicIsRefused) {
  std::mt19937_64 random(test_seed(2));
  const Chunk c = chunk(20, 10, true, random);
  const Blob good = encode_chunk(c);
  std::string what;
  Blob bad = good;
  bad[0] = std::byte{'D'};
  decoded(bad, c, what);
  EXPECT_EQ(what, "not a payload chunk");
  bad = good, bad[1] = std::byte{9};
  decoded(bad, c, what);
  EXPECT_EQ(what, "a payload of an unknown version");
  bad = good, bad[7] = std::byte{255};
  decoded(bad, c, what);
  EXPECT_EQ(what, "a payload that ends early");
  decoded({}, c, what);
  EXPECT_EQ(what, "not a payload chunk");
  decoded(good, chunk(21, 10, false, random), what);
  EXPECT_NE(what, "") << "a chunk of another width";
  bad = good, bad.push_back(std::byte{0});
  decoded(bad, c, what);
  EXPECT_NE(what, "") << "a byte too many";
  bad = good, bad[2] = std::byte{0};
  decoded(bad, c, what);
  EXPECT_EQ(what, "a payload with bytes left over");
}

TEST(Payload, ImpossibleCellsAreRefused) {
  std::mt19937_64 random(test_seed(3));
  Chunk c = chunk(20, 10, true, random);
  c.cells[57] = 16;
  std::string what;
  decoded(encode_chunk(c), c, what);
  EXPECT_EQ(what, "a payload with an impossible cell mask");
}

TEST(Payload, HostileBytesNeverDoMoreThanGiveOtherCodes) {
  std::mt19937_64 random(test_seed(4));
  const Chunk c = chunk(40, 30, true, random);
  const Blob good = encode_chunk(c);
  std::string what;
  for (std::size_t n = 0; n < good.size(); n += 1 + n / 64) {
    decoded(Blob(good.begin(), good.begin() + std::ptrdiff_t(n)), c, what);
    EXPECT_NE(what, "") << "cut after " << n;
  }
  for (int round = 0; round < 2000; ++round) {
    Blob bad = good;
    for (int k = 0; k < 1 + round % 5; ++k) bad[random() % bad.size()] = std::byte(random());
    const Chunk back = decoded(bad, c, what);
    if (!what.empty()) continue;
    EXPECT_EQ(back.codes.size(), c.codes.size());
    for (const std::uint8_t cell : back.cells) EXPECT_LE(cell, 15);
  }
}

}  // namespace
}  // namespace patchwork
