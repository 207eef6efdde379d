// The renderer's compiled shaders, in the executable.
#pragma once

#include <cstdint>
#include <span>

namespace patchwork::shaders {

std::span<const std::uint32_t> tile_finish();
std::span<const std::uint32_t> factors();
std::span<const std::uint32_t> mesh_finish();
std::span<const std::uint32_t> factor_edges();
std::span<const std::uint32_t> needs();
std::span<const std::uint32_t> mesh_edges();
std::span<const std::uint32_t> triangles();
std::span<const std::uint32_t> block_vert();
std::span<const std::uint32_t> block_tesc();
std::span<const std::uint32_t> block_tese();
std::span<const std::uint32_t> mesh_vert();
std::span<const std::uint32_t> terrain_frag();
std::span<const std::uint32_t> sky_vert();
std::span<const std::uint32_t> sky_frag();
std::span<const std::uint32_t> light();

}  // namespace patchwork::shaders
