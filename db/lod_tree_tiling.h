// Which boxes share a page of the R-tree that is built in bulk (used by lod_tree.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "db/lod_page.h"

namespace patchwork {

/// Parts the entries into `pages` groups of about equal size such that cuts read few of them: calls
/// done(indices of a group), in an order that keeps neighbours together. REQUIRES: 1 <= pages <= number of
/// entries.
void tile(const std::vector<LodEntry>& entries, std::size_t pages,
          const std::function<void(std::span<const std::uint32_t>)>& done);

}  // namespace patchwork
