// The compiled shaders, in the executable.
#pragma once

#include <cstdint>
#include <span>

namespace patchwork::shaders {

std::span<const std::uint32_t> classify();
std::span<const std::uint32_t> blend();
std::span<const std::uint32_t> exact();

}  // namespace patchwork::shaders
