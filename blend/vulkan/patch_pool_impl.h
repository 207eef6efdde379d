// The pool's buffers, as shaders see them.
#pragma once

#include "blend/placed.h"
#include "blend/vulkan/buffer_impl.h"
#include "blend/vulkan/patch_pool.h"

namespace patchwork {

/// A slot's numbers in float32, texels of common.glsl's `records`; rectangles in window coordinates.
struct PatchRecord32 {
  float kernel[4], ramp[4], domain[4], samples[4];
  float slope[4];            // 1 / widths of the ramps at i0, j0, i1, j1
  float volume, rim, holes;  // slot of its holes; -1 none
  float kind;                // PatchKind
  float turn[4];             // du/dx, du/dy, dv/dx, dv/dy
};
static_assert(sizeof(PatchRecord32) == 7 * 16);

enum PatchKind {
  kSolid = 1,  ///< in its kernel it answers alone: no holes, and its samples reach beyond it
  kPlain = 2,  ///< no holes, and samples everywhere
  kSteep = 4   ///< shifted by the smoothness: too steep for it
};

/// The same in double, for exact.comp.
struct PatchRecord64 {
  double x0, y0, ua, ub, va, vb, first_i, first_j;
  double kernel[4], ramp[4], domain[4], samples[4];
  double quantum, base, origin, volume, error[3], rim;
};
static_assert(sizeof(PatchRecord64) == 32 * 8);

/// Metres, by smoothness: between neighbouring samples that differ by more an interpolant in float32 would
/// round by more than half a millimetre (1.2e-7 of the difference at 0, 3e-7 above). Coarse levels of rough
/// terrain come near.
inline constexpr double kTooSteep[] = {4000, 1500, 1500};

/// No holes, and samples everywhere.
bool is_plain(const Blend::Placed& p);

struct PatchPool::Impl {
  std::shared_ptr<Device> device;
  vk::Buffer samples, records, exact;
  vk::OwnedView sample_texels, word_texels, record_texels;
  vk::UploadRing ring;
};

}  // namespace patchwork
