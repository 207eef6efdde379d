// A yardstick: settings over generated terrain that is the same everywhere, measured beside those of a
// database.
#pragma once

#include <string>

#include "db/database.h"

namespace patchwork::cli {

/// One grid of generated terrain, 1025 x 1025 samples 10 m apart, in a database in `folder`. Throws Error:
/// the disk.
Database make_reference(const std::string& folder, std::uint64_t memory);
/// Metres, for uniform cuts of it: all of its patches, a tenth, a few.
inline constexpr double kReferenceErrors[] = {0, 30, 50};

}  // namespace patchwork::cli
