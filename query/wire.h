// A difference of extractions as bytes: what a client on the other end of a wire needs to follow a cut.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "query/extract.h"

namespace patchwork {

/// What a client gets for a difference. It holds each patch as a reader of the database would.
struct Update {
  struct Source {  ///< of patches: what every patch of a grid shares
    GridId id;
    Frame frame;
    GridShape shape;
    double quantum = 1, base = 0;  ///< metres
    double rim_error = 0;          ///< metres
    std::int64_t code_origin = 0;  ///< height = quantum (code_origin + code) + base
  };
  struct Patch {
    std::array<double, 3> error{};  ///< metres, of smoothness k = 0, 1, 2
    double bottom = 0;              ///< metres
    PatchSurface surface;
  };
  std::vector<Source> sources;
  std::vector<Patch> add;
  std::vector<PatchId> drop;
};

/// Reads the patches' samples. Throws Error for damaged payloads.
std::vector<std::byte> encode_update(const Database& db, const Difference& difference);
/// Throws Error ("update", ...) for whatever encode_update does not make.
Update decode_update(std::span<const std::byte> bytes);

}  // namespace patchwork
