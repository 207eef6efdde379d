#include "tools/bench/pyramid_coder.h"

#include <Lerc_c_api.h>
#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>

#include "db/error.h"
#include "db/payload.h"

namespace patchwork::cli {

namespace {

constexpr int kPeerTile = 512;    // samples, as GDAL's COG driver cuts them
constexpr int kZstdLevel = 9;     // as GDAL's drivers have it unless told otherwise
constexpr unsigned kLercInt = 4;  // LERC's number for int32

using Bytes = std::vector<std::byte>;
using Samples = std::vector<std::int32_t>;

struct Tile {
  int x, y, cols, rows;
};

std::vector<Tile> tiles(const Level& l, int side) {
  std::vector<Tile> all;
  for (int y = 0; y < l.rows; y += side)
    for (int x = 0; x < l.cols; x += side)
      all.push_back({x, y, std::min(side, l.cols - x), std::min(side, l.rows - y)});
  return all;
}

template <class Change>
void cut(const Level& l, const Tile& t, Samples& out, Change change) {
  out.resize(std::size_t(t.cols) * std::size_t(t.rows));
  for (int y = 0; y < t.rows; ++y) {
    const std::int32_t* from = l.samples.data() + std::size_t(t.y + y) * std::size_t(l.cols) + t.x;
    std::transform(from, from + t.cols, out.data() + std::size_t(y) * std::size_t(t.cols), change);
  }
}

template <class Change>
void paste(const Samples& tile, const Tile& t, Level& l, Change change) {
  for (int y = 0; y < t.rows; ++y) {
    const std::int32_t* from = tile.data() + std::size_t(y) * std::size_t(t.cols);
    std::transform(from, from + t.cols, l.samples.data() + std::size_t(t.y + y) * std::size_t(l.cols) + t.x,
                   change);
  }
}

Samples as_they_are(const Level& l, const Tile& t) {
  Samples out;
  cut(l, t, out, [](std::int32_t v) { return v; });
  return out;
}

// Codes of quantum 2 * tolerance, nearest, in the chunks of a database: `related` to the level above or each
// level by itself.
class ChunkCoder : public Coder {
 public:
  ChunkCoder(std::string called, bool related) : Coder(std::move(called)), related_(related) {}

  void encode(const Pyramid& pyramid, int tolerance) override {
    quantum_ = std::max(1, 2 * tolerance);
    const auto code = [half = tolerance, quantum = quantum_](std::int32_t v) {
      const int up = v + half;
      return up >= 0 ? up / quantum : -((quantum - 1 - up) / quantum);
    };
    make_room(pyramid), blobs_.clear();
    each_chunk(pyramid,
               [&](const Level& l, const Tile& t, Chunk& chunk, const Chunk* parent, int cx, int cy) {
                 cut(l, t, chunk.codes, code);
                 blobs_.push_back(encode_chunk(chunk, parent, cx, cy));
               });
  }

  void decode(Pyramid& out) const override {
    make_room(out);
    auto blob = blobs_.begin();
    each_chunk(out, [&](Level& l, const Tile& t, Chunk& chunk, const Chunk* parent, int cx, int cy) {
      const std::string bad = decode_chunk(*blob++, chunk, parent, cx, cy);
      if (!bad.empty()) throw Error(name, bad);
      paste(chunk.codes, t, l, [quantum = quantum_](std::int32_t c) { return c * quantum; });
    });
  }

 private:
  static int across(const Level& l) { return (l.cols + kChunkVertices - 1) / kChunkVertices; }
  void make_room(const Pyramid& pyramid) const {
    chunks_.resize(pyramid.size());
    for (std::size_t l = 0; l < pyramid.size(); ++l)
      chunks_[l].resize(tiles(pyramid[l], kChunkVertices).size());
  }

  // From the top down, so that parents come first.
  template <class Levels, class Use>
  void each_chunk(Levels& pyramid, Use use) const {
    for (std::size_t l = pyramid.size(); l-- > 0;)
      for (const Tile& t : tiles(pyramid[l], kChunkVertices)) {
        const int cx = t.x / kChunkVertices, cy = t.y / kChunkVertices;
        const auto at = [&](std::size_t level, int x, int y) -> Chunk& {
          return chunks_[level][std::size_t(y) * std::size_t(across(pyramid[level])) + std::size_t(x)];
        };
        Chunk& chunk = at(l, cx, cy);
        chunk.cols = t.cols, chunk.rows = t.rows;
        const bool top = l + 1 == pyramid.size();
        use(pyramid[l], t, chunk, related_ && !top ? &at(l + 1, cx / 2, cy / 2) : nullptr, cx, cy);
      }
  }

  bool related_;
  int quantum_ = 1;
  mutable std::vector<std::vector<Chunk>> chunks_;  // what a cache of decoded chunks would hold
};

// One blob a tile.
class TileCoder : public Coder {
 public:
  using Coder::Coder;
  void encode(const Pyramid& pyramid, int tolerance) override {
    blobs_.clear();
    for (const Level& l : pyramid)
      for (const Tile& t : tiles(l, kPeerTile)) blobs_.push_back(encode(as_they_are(l, t), t, tolerance));
  }
  void decode(Pyramid& out) const override {
    auto blob = blobs_.begin();
    for (Level& l : out)
      for (const Tile& t : tiles(l, kPeerTile)) {
        Samples samples(std::size_t(t.cols) * std::size_t(t.rows));
        decode(*blob++, t, samples);
        paste(samples, t, l, [](std::int32_t v) { return v; });
      }
  }

 protected:
  virtual Bytes encode(Samples samples, const Tile& t, int tolerance) = 0;
  virtual void decode(const Bytes& bytes, const Tile& t, Samples& out) const = 0;
};

Bytes zstd(const void* data, std::size_t size) {
  Bytes out(ZSTD_compressBound(size));
  out.resize(ZSTD_compress(out.data(), out.size(), data, size, kZstdLevel));
  return out;
}

Bytes unzstd(const Bytes& bytes) {
  Bytes out(ZSTD_getFrameContentSize(bytes.data(), bytes.size()));
  if (ZSTD_isError(ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size())))
    throw Error("zstd", "it cannot read its own bytes");
  return out;
}

class LercCoder : public TileCoder {
 public:
  LercCoder(std::string called, bool then_zstd) : TileCoder(std::move(called)), then_zstd_(then_zstd) {}

 private:
  Bytes encode(Samples samples, const Tile& t, int tolerance) override {
    Bytes out(samples.size() * sizeof(std::int32_t) + 4096);
    unsigned written = 0;
    check(lerc_encode(samples.data(), kLercInt, 1, t.cols, t.rows, 1, 0, nullptr, tolerance,
                      reinterpret_cast<unsigned char*>(out.data()), unsigned(out.size()), &written));
    out.resize(written);
    return then_zstd_ ? zstd(out.data(), out.size()) : out;
  }
  void decode(const Bytes& bytes, const Tile& t, Samples& out) const override {
    const Bytes unpacked = then_zstd_ ? unzstd(bytes) : Bytes();
    const Bytes& blob = then_zstd_ ? unpacked : bytes;
    check(lerc_decode(reinterpret_cast<const unsigned char*>(blob.data()), unsigned(blob.size()), 0, nullptr,
                      1, t.cols, t.rows, 1, kLercInt, out.data()));
  }
  static void check(lerc_status status) {
    if (status) throw Error("LERC", fmt::format("it fails with status {}", status));
  }
  bool then_zstd_;
};

// Differences along rows, 16 bits each where the samples' range allows (modulo 2^16), then zstd.
class DeltaCoder : public TileCoder {
 public:
  using TileCoder::TileCoder;

 private:
  Bytes encode(Samples samples, const Tile& t, int tolerance) override {
    quantum_ = std::max(1, 2 * tolerance);
    for (std::int32_t& v : samples) v = std::int32_t(std::floor((v + tolerance) / double(quantum_)));
    const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
    const bool narrow = *low >= -32768 && *high <= 32767;
    for (std::size_t row = 0; row < samples.size(); row += std::size_t(t.cols))
      for (std::size_t i = row + std::size_t(t.cols) - 1; i > row; --i) samples[i] -= samples[i - 1];
    if (!narrow) return zstd(samples.data(), samples.size() * sizeof(std::int32_t));
    const std::vector<std::int16_t> half(samples.begin(), samples.end());
    return zstd(half.data(), half.size() * sizeof(std::int16_t));
  }
  void decode(const Bytes& bytes, const Tile& t, Samples& out) const override {
    const Bytes plain = unzstd(bytes);
    const bool narrow = plain.size() < out.size() * sizeof(std::int32_t);
    if (narrow)
      sum(reinterpret_cast<const std::int16_t*>(plain.data()), t, out);
    else
      sum(reinterpret_cast<const std::int32_t*>(plain.data()), t, out);
  }
  template <class Value>
  void sum(const Value* deltas, const Tile& t, Samples& out) const {
    for (std::size_t row = 0; row < out.size(); row += std::size_t(t.cols)) {
      Value value = 0;
      for (std::size_t i = row; i < row + std::size_t(t.cols); ++i)
        value = Value(value + deltas[i]), out[i] = value * quantum_;
    }
  }
  int quantum_ = 1;
};

}  // namespace

double Coder::bytes() const {
  double sum = 0;
  for (const Bytes& b : blobs_) sum += double(b.size());
  return sum;
}

std::vector<std::unique_ptr<Coder>> make_coders() {
  std::vector<std::unique_ptr<Coder>> all;
  all.push_back(std::make_unique<ChunkCoder>("ours", true));
  all.push_back(std::make_unique<ChunkCoder>("each level alone", false));
  all.push_back(std::make_unique<LercCoder>("LERC", false));
  all.push_back(std::make_unique<LercCoder>("LERC ZSTD", true));
  all.push_back(std::make_unique<DeltaCoder>("deltas ZSTD"));
  return all;
}

}  // namespace patchwork::cli
