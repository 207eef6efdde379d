// The ways of storing a pyramid of integer samples that `patchwork bench codec` compares.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace patchwork::cli {

/// Row-major samples in units of their file; each level has every other one of the level before.
struct Level {
  int cols, rows;
  std::vector<std::int32_t> samples;
};
using Pyramid = std::vector<Level>;

/// A pyramid's way into bytes within a tolerance (units; 0 is lossless), and back.
class Coder {
 public:
  explicit Coder(std::string called) : name(std::move(called)) {}
  virtual ~Coder() = default;
  virtual void encode(const Pyramid& pyramid, int tolerance) = 0;
  /// Fills the samples; the sizes say what is expected. Throws Error: the bytes are not its own.
  virtual void decode(Pyramid& out) const = 0;
  double bytes() const;  ///< of what was encoded last

  const std::string name;
  std::vector<double> encoded, decoded;  // millions of samples a second
  double error = 0;                      // the largest, units

 protected:
  std::vector<std::vector<std::byte>> blobs_;
};

/// Ours, our coder without the level above, LERC, LERC in zstd, and differences along rows in zstd.
std::vector<std::unique_ptr<Coder>> make_coders();

}  // namespace patchwork::cli
