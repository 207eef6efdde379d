// Where patches ready to be evaluated live: slabs of huge pages, used again and again.
#pragma once

#include <memory_resource>

namespace patchwork {

/// Safe from many threads. Lives as long as the process, because what it gave out may; its size is the
/// largest that the caches ever had. With pages of 4 KiB, faulting in the 12 000 patches of a mosaic took
/// longer than cutting them.
std::pmr::memory_resource& surface_pool();

}  // namespace patchwork
