// The stored form of a run of integers that are mostly small: what a predictor of samples missed by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace patchwork {

/// Appends the run's bytes to `out`; any int32 values, any number of them.
void append_differences(std::span<const std::int32_t> differences, std::vector<std::byte>& out);

/// Fills `out` and takes the run that it came from off the front of `bytes`; returns "" or what is wrong with
/// the bytes (which are hostile until proven sound).
std::string take_differences(std::span<const std::byte>& bytes, std::span<std::int32_t> out);

}  // namespace patchwork
