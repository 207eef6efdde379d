// CpuGpuParity (hard cases): the shaders' surface is the CPU's, wherever a surface is hard to get right.
#include <gtest/gtest.h>

#include "tests/blend/vulkan_scene.h"

namespace patchwork {
namespace {

class CpuGpuParity : public VulkanTest {
 protected:
  // Both engines on one extraction, as a raster and as points.
  static ParityFigures compare(const Database& db, std::span<const PatchId> patches,
                               const RasterFrame& raster, int side, const std::string& what) {
    ParityFigures all;
    for (const BlendOptions& options : all_blends()) {
      const Blend cpu(db, patches, options);
      const VulkanBlend gpu(test_device(), db, patches, options);
      const std::string name = what + " " + name_of(options);
      const ParityFigures f = expect_parity(at_pixels(cpu, raster, side), at_pixels(gpu, raster, side), name);
      all.points += f.points, all.answered += f.answered, all.worst = std::max(all.worst, f.worst);
    }
    return all;
  }
  static ParityFigures compare(const Scene& scene, double error, double degrees, const std::string& what) {
    const Extraction x = extract(scene.db(), {.error = error});
    const ParityFigures f = compare(scene.db(), x.patches, turned_raster(scene.db().extent(), 150, degrees),
                                    150, what + " error " + std::to_string(error));
    std::printf("%-40s error %-6g %zu points, worst %.3f of the limit\n", what.c_str(), error, f.points,
                f.worst);
    EXPECT_GT(f.answered, f.points / 50) << what;
    return f;
  }
};

TEST_F(CpuGpuParity, RotatedMirroredAndOverlappingGridsUnderUniformCuts) {
  const Scene scene(surveys());
  for (const double error : {0.0, 1.0, 5.0, 100.0}) compare(scene, error, 11, "surveys");
}

}  // namespace
}  // namespace patchwork
