// A scene's effects as the numbers that shaders read.
#pragma once

#include <array>
#include <cstdint>

#include "render/effects/glsl.h"
#include "render/effects/registry.h"
#include "render/scene.h"

namespace patchwork::effects {

using Look = glsl::Look;

/// Of a frame. `scale`: of the error or cost overlay; `tints`: lowest and highest height, metres.
struct LookInput {
  SceneView view;
  ValueScale tints{};
  ValueScale scale{};
};
Look look_of(const Scene& scene, const LookInput& input);

/// A colour in linear light.
glm::dvec3 linear(const Color& c);

/// The uniform block: floats in the order of look.glsl.
inline constexpr std::size_t kLookFloats = sizeof(Look) / sizeof(double);
std::array<float, kLookFloats> block_of(const Look& look);

}  // namespace patchwork::effects
