#include "blend/vulkan/shaders.h"

namespace patchwork::shaders {

namespace {

// Made by glslc in the build tree, numbers alone (blend/CMakeLists.txt).
constexpr std::uint32_t kClassify[] = {
#include "classify.comp.inc"
};
constexpr std::uint32_t kBlend[] = {
#include "blend.comp.inc"
};
constexpr std::uint32_t kExact[] = {
#include "exact.comp.inc"
};

}  // namespace

std::span<const std::uint32_t> classify() { return kClassify; }
std::span<const std::uint32_t> blend() { return kBlend; }
std::span<const std::uint32_t> exact() { return kExact; }

}  // namespace patchwork::shaders
