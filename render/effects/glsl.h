// GLSL's names in C++, in double: the effects' formulas are written once, as GLSL, and the CPU's reference is
// the same text. An including file brackets it:
//     #define float double
//     #include "render/effects/haze.glsl"
//     #undef float
#pragma once

#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace patchwork::glsl {

using vec2 = glm::dvec2;
using vec3 = glm::dvec3;
using vec4 = glm::dvec4;
using glm::abs, glm::acos, glm::atan, glm::clamp, glm::cos, glm::dot, glm::exp, glm::floor, glm::fract,
    glm::length, glm::log, glm::max, glm::min, glm::mix, glm::normalize, glm::pow, glm::sin, glm::smoothstep,
    glm::sqrt, glm::step;

#define float double
#include "render/effects/look.glsl"
#undef float

}  // namespace patchwork::glsl
