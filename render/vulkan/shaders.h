// The renderer's compiled shaders, in the executable.
#pragma once

#include <cstdint>
#include <span>

namespace patchwork::shaders {

std::span<const std::uint32_t> tile_finish();
std::span<const std::uint32_t> factors();
std::span<const std::uint32_t> edges();
std::span<const std::uint32_t> terrain_vert();
std::span<const std::uint32_t> terrain_tesc();
std::span<const std::uint32_t> terrain_tese();
std::span<const std::uint32_t> terrain_frag();
std::span<const std::uint32_t> sky_vert();
std::span<const std::uint32_t> sky_frag();
std::span<const std::uint32_t> light();

}  // namespace patchwork::shaders
