// What the tests of the blend on the graphics card share: one validated device, and a comparison with the
// CPU.
#pragma once

#include <bit>

#include "blend/vulkan/vulkan_blend.h"
#include "tests/blend/scene.h"

namespace patchwork {

/// The device of all tests, watched by the validation layer. A machine without one fails.
inline std::shared_ptr<Device> test_device() {
  static const std::shared_ptr<Device> device = Device::open({.validation = true});
  return device;
}

/// Fails a test if the validation layer said anything during it.
class VulkanTest : public ::testing::Test {
 protected:
  void SetUp() override { before_ = test_device()->messages().size(); }
  void TearDown() override {
    const std::vector<std::string> all = test_device()->messages();
    for (std::size_t k = before_; k < all.size(); ++k) ADD_FAILURE() << all[k];
  }

 private:
  std::size_t before_ = 0;
};

/// The limit of CpuGpuParity, metres.
inline double parity(double height) { return 1e-3 + 1e-6 * std::abs(height); }

struct ParityFigures {
  std::size_t points = 0, answered = 0, others = 0;  // others: another grid speaks loudest
  double worst = 0;                                  ///< largest difference, in limits
  void add(const ParityFigures& o) {
    points += o.points, answered += o.answered, others += o.others, worst = std::max(worst, o.worst);
  }
};

/// Where the two differ by more than parity allows, or one answers and the other does
/// not; and where many points name another grid. A bound of `gpu` counts what parity allows.
inline ParityFigures expect_parity(const Answers& cpu, const Answers& gpu, const std::string& what) {
  ParityFigures f{.points = cpu.height.size()};
  std::size_t failures = 0;
  for (std::size_t k = 0; k < cpu.height.size(); ++k) {
    const bool same = (cpu.source[k] == 0) == (gpu.source[k] == 0);
    f.others += cpu.source[k] != gpu.source[k];
    bool close = true;
    if (same && cpu.source[k] != 0) {
      ++f.answered;
      const double height = std::abs(cpu.height[k] - gpu.height[k]) / parity(cpu.height[k]),
                   bound =
                       std::abs(cpu.bound[k] + parity(gpu.height[k]) - gpu.bound[k]) / parity(cpu.bound[k]);
      close = height <= 1 && bound <= 1;  // false for NaN
      f.worst = std::max({f.worst, height, bound});
    }
    if ((!same || !close) && ++failures < 5)
      ADD_FAILURE() << what << " at " << k << ": cpu " << cpu.height[k] << " +- " << cpu.bound[k] << " of "
                    << cpu.source[k] << ", gpu " << gpu.height[k] << " +- " << gpu.bound[k] << " of "
                    << gpu.source[k];
  }
  EXPECT_EQ(failures, 0u) << what;
  EXPECT_LE(f.others, f.points / 200) << what << ": more than what weighs alike";
  return f;
}

/// A raster of about `side` x `side` pixels over an extent, a little turned, a little larger than it.
inline RasterFrame turned_raster(const Extent& e, int side, double degrees) {
  const double a = degrees * std::numbers::pi / 180, w = e.xmax - e.xmin, h = e.ymax - e.ymin;
  const double step = 1.05 * std::max(w, h) / side, c = step * std::cos(a), s = step * std::sin(a);
  const double x = 0.5 * (e.xmin + e.xmax), y = 0.5 * (e.ymin + e.ymax), half = 0.5 * (side - 1);
  return {x - half * (c + s), c, s, y - half * (s - c), s, -c};
}

inline Answers at_pixels(const Evaluator& blend, const RasterFrame& raster, int side) {
  Answers a(std::size_t(side) * std::size_t(side));
  BlendOutput out = a.out();
  out.patch = {};
  blend.at_pixels(raster, side, 0, side, out);
  return a;
}

inline Answers at_points(const Evaluator& blend, const Points& points) {
  Answers a(points.size());
  BlendOutput out = a.out();
  out.patch = {};
  blend.at_points(points.x, points.y, out);
  return a;
}

}  // namespace patchwork
